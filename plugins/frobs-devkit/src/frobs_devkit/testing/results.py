"""Functions that run checks directly or as pytest tests, and the report of the results."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from frobs_core import plugins
from frobs_core.util.errors import check_name
from frobs_devkit.doctor.requirements import required_versions
from frobs_devkit.testing.checks import Check, CheckFailure, Inconclusive, NotApplicable

_STATUSES: Mapping[type[Exception], str] = {Inconclusive: "inconclusive", NotApplicable: "not_applicable"}
_DECIDING = ("gymnasium", "numpy")  # requirements of frobs-core whose versions can change numerical results


@dataclass(frozen=True)
class Result:
    """Result of one check.

    Attributes:
        name: Name of the check.
        description: Description of the check.
        status: ``"passed"``, ``"failed"``, ``"expected_failure"``, ``"skipped"``, ``"inconclusive"`` or
            ``"not_applicable"``. A check is skipped if a required check failed, or if it fails with the same message as
            an earlier check.
        message: Reason why the check did not pass, or ``""``.
        seconds: Duration of the check [s].
        capability: Simulator capability that the check verifies, or ``""``.
    """

    name: str
    description: str
    status: str
    message: str = ""
    seconds: float = 0.0
    capability: str = ""


@dataclass(frozen=True)
class Report:
    """Results of a list of checks.

    Attributes:
        results: Results in the order of the checks.
        versions: Versions of Python, frobs-core, the plugins and their requirements, by name.
    """

    results: tuple[Result, ...]
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether no check failed."""
        return not self.failed

    @property
    def failed(self) -> tuple[Result, ...]:
        """Results of the failed checks."""
        return tuple(result for result in self.results if result.status == "failed")

    @property
    def inconclusive(self) -> tuple[Result, ...]:
        """Results of the checks during which the tested situation did not occur."""
        return tuple(result for result in self.results if result.status == "inconclusive")

    @property
    def verified_capabilities(self) -> tuple[str, ...]:
        """Sorted names of the capabilities with at least one passed check and no failed or inconclusive check."""
        passed = {result.capability for result in self.results if result.status == "passed"}
        doubtful = {result.capability for result in self.results if result.status in ("failed", "inconclusive")}
        return tuple(sorted(passed - doubtful - {""}))

    def as_dict(self) -> dict[str, Any]:
        """Return the report as the plain data that ``--json`` prints: numbers, strings, lists and dictionaries."""
        return {
            "ok": self.ok,
            "verified_capabilities": list(self.verified_capabilities),
            "versions": dict(self.versions),
            "checks": [asdict(result) for result in self.results],
        }


def run_checks(
    checks: Iterable[Check],
    on_result: Callable[[Result], None] | None = None,
    expected_failures: Mapping[str, str] | None = None,
) -> Report:
    """Run all checks, even if some of them fail, and return a report.

    Args:
        checks: Result of a ``check_…`` function.
        on_result: Function that is called with each result, for example to show the progress.
        expected_failures: Reasons for expected failures, by check name. If such a check passes, it is reported as failed.

    Raises:
        UnknownNameError: ``expected_failures`` contains an unknown check name.
    """
    checks, reasons = list(checks), dict(expected_failures or {})
    _refuse_unknown(reasons, checks)
    results: list[Result] = []
    for check in checks:
        result = _without_cause(check, results) or _run(check)
        same = next((one.name for one in results if one.status == "failed" and one.message == result.message), "")
        if result.status == "failed" and same:  # report failures with the same cause only once
            result = replace(result, status="skipped", message=f"the check fails for the same reason as {same}")
        if check.name in reasons:
            result = _expected(result, reasons[check.name])
        results.append(result)
        if on_result is not None:
            on_result(result)
    return Report(tuple(results), _versions())


def pytest_checks(
    checks: Iterable[Check], *, expected_failures: Mapping[str, str] | None = None, allow_inconclusive: bool = True
) -> Callable[[Check], None]:
    """Return a pytest test function with one test case for each check.

    Example::

        test_conformance = pytest_checks(check_env("frobs_core:frobs/Irb120Reach-v0"))

    Pytest reports inconclusive and inapplicable checks as skipped, with the reason.

    Args:
        checks: Result of a ``check_…`` function.
        expected_failures: Reasons for expected failures, by check name. If such a check passes, it is reported as failed.
        allow_inconclusive: If False, inconclusive checks are reported as failed.

    Raises:
        UnknownNameError: ``expected_failures`` contains an unknown check name.
    """
    import pytest  # imported here because 'frobs check' uses this module without pytest

    checks, reasons = list(checks), dict(expected_failures or {})
    _refuse_unknown(reasons, checks)
    cases = [
        pytest.param(
            check,
            id=check.name,
            marks=[pytest.mark.xfail(reason=reasons[check.name], strict=True)] if check.name in reasons else [],
        )
        for check in checks
    ]

    failed: set[str] = set()

    @pytest.mark.parametrize("check", cases)
    def test_conformance(check: Check) -> None:
        causes = failed & set(check.requires)
        if causes:
            pytest.skip(f"{', '.join(sorted(causes))} failed")
        try:
            check.run()
        except Inconclusive as reason:
            (pytest.skip if allow_inconclusive else pytest.fail)(f"inconclusive: {reason}")
        except NotApplicable as reason:
            pytest.skip(f"not applicable: {reason}")
        except Exception:
            failed.add(check.name)
            raise

    return test_conformance


def _refuse_unknown(expected_failures: Iterable[str], checks: Iterable[Check]) -> None:
    names = [check.name for check in checks]
    for name in expected_failures:
        check_name("check", name, names)


def _without_cause(check: Check, results: Iterable[Result]) -> Result | None:
    """Return a skipped result if a required check has failed or was skipped, or None if the check can run."""
    causes = [one.name for one in results if one.status in ("failed", "skipped") and one.name in check.requires]
    if not causes:
        return None
    return Result(check.name, check.description, "skipped", f"{', '.join(causes)} failed", 0.0, check.capability)


def _expected(result: Result, reason: str) -> Result:
    if result.status == "failed":
        return replace(result, status="expected_failure", message=f"{reason}: {result.message}")
    if result.status == "passed":
        return replace(result, status="failed", message=f"the check passes, but was expected to fail: {reason}")
    return result


def _run(check: Check) -> Result:
    start = time.perf_counter()
    status, message = "passed", ""
    try:
        check.run()
    except (CheckFailure, Inconclusive, NotApplicable) as outcome:
        status = next((name for kind, name in _STATUSES.items() if isinstance(outcome, kind)), "failed")
        message = str(outcome)
    except Exception as error:  # the checked object may raise any exception, and the other checks still run
        status, message = "failed", f"{type(error).__name__}: {error}"
    seconds = round(time.perf_counter() - start, 3)
    return Result(check.name, check.description, status, message, seconds, check.capability)


def _versions() -> dict[str, str]:
    loaded = sorted({report.distribution for report in plugins.reports() if report.state == "loaded"})
    versions = {"python": platform.python_version()}
    for distribution in ("frobs-core", *loaded):
        try:
            versions[distribution] = version(distribution)
        except PackageNotFoundError:  # the plugin was defined by a test and is not installed
            continue
        required = required_versions(distribution)
        for name in _DECIDING if distribution == "frobs-core" else required:
            versions.setdefault(name, required[name])
    return versions

"""Running checks, one after the other or as tests of pytest, and what came of it, as data."""

from __future__ import annotations

import platform
import re
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Any

from frobs_core import plugins
from frobs_core.errors import UnknownNameError
from frobs_devkit.testing.checks import Check, CheckFailure, Inconclusive, NotApplicable

_DECIDING = ("gymnasium", "numpy")
"""What of the core's requirements decides over numbers."""


@dataclass(frozen=True)
class Result:
    """What came of one check.

    Attributes:
        name: The check's.
        description: The check's.
        status: ``"passed"``, ``"failed"``, ``"expected_failure"``, ``"skipped"`` (what it requires
            failed, or it failed with the message of another), ``"inconclusive"`` or ``"not_applicable"``.
        message: Why, where it has not passed.
        seconds: How long it took [s].
        capability: The simulator's capability that it verifies, or ``""``.
    """

    name: str
    description: str
    status: str
    message: str = ""
    seconds: float = 0.0
    capability: str = ""


@dataclass(frozen=True)
class Report:
    """What came of a list of checks.

    Attributes:
        results: In the order of the checks.
        versions: Of what they ran on, by package: the core, the plugins, and what those require.
    """

    results: tuple[Result, ...]
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether no check failed."""
        return not self.failed

    @property
    def failed(self) -> tuple[Result, ...]:
        """The results of the checks that failed."""
        return tuple(result for result in self.results if result.status == "failed")

    @property
    def inconclusive(self) -> tuple[Result, ...]:
        """The results of the checks that saw nothing that could have failed."""
        return tuple(result for result in self.results if result.status == "inconclusive")

    @property
    def verified_capabilities(self) -> tuple[str, ...]:
        """The capabilities of which at least one check passed and none failed or was inconclusive, by name."""
        passed = {result.capability for result in self.results if result.status == "passed"}
        doubtful = {result.capability for result in self.results if result.status in ("failed", "inconclusive")}
        return tuple(sorted(passed - doubtful - {""}))

    def as_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints: numbers, strings, lists and dictionaries."""
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
    """Run checks; one that fails does not stop the others.

    Args:
        checks: From the ``check_…`` functions.
        on_result: Called after each, for a progress display.
        expected_failures: Why a check fails, by its name. It must fail: one that passes is a failure.

    Raises:
        UnknownNameError: An expected failure names none of the checks.
    """
    checks, reasons = list(checks), dict(expected_failures or {})
    _refuse_unknown(reasons, checks)
    results: list[Result] = []
    for check in checks:
        result = _without_cause(check, results) or _run(check)
        same = next((one.name for one in results if one.status == "failed" and one.message == result.message), "")
        if result.status == "failed" and same:  # one cause, one failure
            result = replace(result, status="skipped", message=f"it fails as {same} does")
        if check.name in reasons:
            result = _expected(result, reasons[check.name])
        results.append(result)
        if on_result is not None:
            on_result(result)
    return Report(tuple(results), _versions())


def pytest_checks(
    checks: Iterable[Check], *, expected_failures: Mapping[str, str] | None = None, allow_inconclusive: bool = True
) -> Callable[[Check], None]:
    """Return a test function with one case for each check.

    Example::

        test_conformance = pytest_checks(check_env("frobs_core:frobs/Irb120Reach-v0"))

    A check that is inconclusive or not applicable is shown as skipped, with its reason.

    Args:
        checks: From the ``check_…`` functions.
        expected_failures: Why a check fails, by its name. It must fail: one that passes is a failure.
        allow_inconclusive: False: an inconclusive check fails.

    Raises:
        UnknownNameError: An expected failure names none of the checks.
    """
    import pytest  # the kit is also used by 'frobs check', where pytest need not be installed

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
    """Raise UnknownNameError where an expected failure names none of the checks."""
    names = [check.name for check in checks]
    for name in expected_failures:
        if name not in names:
            raise UnknownNameError("check", name, names)


def _without_cause(check: Check, results: Iterable[Result]) -> Result | None:
    """Return that a check is skipped because one that it requires has failed; None: it can run."""
    causes = [one.name for one in results if one.status in ("failed", "skipped") and one.name in check.requires]
    if not causes:
        return None
    return Result(check.name, check.description, "skipped", f"{', '.join(causes)} failed", 0.0, check.capability)


def _expected(result: Result, reason: str) -> Result:
    if result.status == "failed":
        return replace(result, status="expected_failure", message=f"{reason}: {result.message}")
    if result.status == "passed":
        return replace(result, status="failed", message=f"it passes, and was expected to fail: {reason}")
    return result


def _run(check: Check) -> Result:
    start = time.perf_counter()
    status, message = "passed", ""
    try:
        check.run()
    except CheckFailure as failure:
        status, message = "failed", str(failure)
    except Inconclusive as reason:
        status, message = "inconclusive", str(reason)
    except NotApplicable as reason:
        status, message = "not_applicable", str(reason)
    except Exception as error:  # a subject may raise anything; the other checks go on
        status, message = "failed", f"{type(error).__name__}: {error}"
    seconds = round(time.perf_counter() - start, 3)
    return Result(check.name, check.description, status, message, seconds, check.capability)


def _versions() -> dict[str, str]:
    """Return the versions of Python, the core, each plugin that is loaded, and what these require."""
    loaded = sorted({report.distribution for report in plugins.reports() if report.state == "loaded"})
    found = {"python": platform.python_version()}
    for distribution in ("frobs-core", *loaded):
        try:
            found[distribution] = version(distribution)
            lines = _DECIDING if distribution == "frobs-core" else requires(distribution) or ()
        except PackageNotFoundError:  # a plugin of a test, which was never installed
            continue
        for name in (re.split(r"[^\w.-]", line)[0] for line in lines if "extra ==" not in line):
            try:
                found.setdefault(name, version(name))
            except PackageNotFoundError:
                continue
    return found

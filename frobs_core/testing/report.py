"""Running checks one after the other, and what came of it, as data."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from frobs_core.testing.checks import Check, CheckFailure, Hollow, NotApplicable

_PACKAGES = ("frobs-core", "gymnasium", "numpy", "mujoco", "stable-baselines3")


@dataclass(frozen=True)
class Result:
    """What came of one check.

    Attributes:
        name: The check's.
        description: The check's.
        status: ``"passed"``, ``"failed"``, ``"hollow"`` or ``"not_applicable"``.
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
        versions: Of what they ran on, by package.
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
    def hollow(self) -> tuple[Result, ...]:
        """The results of the checks that saw nothing that could have failed."""
        return tuple(result for result in self.results if result.status == "hollow")

    @property
    def verified_capabilities(self) -> tuple[str, ...]:
        """The capabilities of which at least one check passed and none failed or was hollow, by name."""
        passed = {result.capability for result in self.results if result.status == "passed"}
        doubtful = {result.capability for result in self.results if result.status in ("failed", "hollow")}
        return tuple(sorted(passed - doubtful - {""}))

    def as_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints: numbers, strings, lists and dictionaries."""
        return {
            "ok": self.ok,
            "verified_capabilities": list(self.verified_capabilities),
            "versions": dict(self.versions),
            "checks": [asdict(result) for result in self.results],
        }


def run_checks(checks: Iterable[Check], on_result: Callable[[Result], None] | None = None) -> Report:
    """Run checks; one that fails does not stop the others.

    Args:
        checks: From the ``check_…`` functions.
        on_result: Called after each, for a progress display.
    """
    results = []
    for check in checks:
        result = _run(check)
        results.append(result)
        if on_result is not None:
            on_result(result)
    return Report(tuple(results), _versions())


def _run(check: Check) -> Result:
    start = time.perf_counter()
    status, message = "passed", ""
    try:
        outcome = check.run()
    except CheckFailure as failure:
        status, message = "failed", str(failure)
    except Exception as error:  # a subject may raise anything; the other checks go on
        status, message = "failed", f"{type(error).__name__}: {error}"
    else:
        if isinstance(outcome, Hollow):
            status, message = "hollow", outcome.reason
        elif isinstance(outcome, NotApplicable):
            status, message = "not_applicable", outcome.reason
    seconds = round(time.perf_counter() - start, 3)
    return Result(check.name, check.description, status, message, seconds, check.capability)


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return versions

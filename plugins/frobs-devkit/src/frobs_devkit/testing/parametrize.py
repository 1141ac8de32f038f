"""The checks as tests of pytest, one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from frobs_devkit.testing.checks import Check, Inconclusive, NotApplicable
from frobs_devkit.testing.report import refuse_unknown


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
    refuse_unknown(reasons, checks)
    cases = [
        pytest.param(
            check,
            id=check.name,
            marks=[pytest.mark.xfail(reason=reasons[check.name], strict=True)] if check.name in reasons else [],
        )
        for check in checks
    ]

    @pytest.mark.parametrize("check", cases)
    def test_conformance(check: Check) -> None:
        outcome = check.run()
        if isinstance(outcome, Inconclusive) and not allow_inconclusive:
            pytest.fail(f"inconclusive: {outcome.reason}")
        if isinstance(outcome, Inconclusive):
            pytest.skip(f"inconclusive: {outcome.reason}")
        if isinstance(outcome, NotApplicable):
            pytest.skip(f"not applicable: {outcome.reason}")

    return test_conformance

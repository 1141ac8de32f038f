from __future__ import annotations

import json

import pytest

from frobs_core.util.errors import UnknownNameError
from frobs_devkit.testing import Check, CheckFailure, Inconclusive, NotApplicable, pytest_checks, run_checks


def fail() -> None:
    raise CheckFailure("it is 3 instead of 2")


def crash() -> None:
    raise ZeroDivisionError("by zero")


def see_nothing() -> None:
    raise Inconclusive("nothing moved")


def decline() -> None:
    raise NotApplicable("no lidar")


CHECKS = [
    Check("good", "It is good.", lambda: None, capability="rays"),
    Check("bad", "It is bad.", fail, capability="drive"),
    Check("good_drive", "It is good.", lambda: None, capability="drive"),
    Check("broken", "It raises.", crash),
    Check("empty", "It saw nothing.", see_nothing, capability="wrench"),
    Check("foreign", "It is not meant.", decline),
]


def test_every_check_runs_and_tells_its_status() -> None:
    seen: list[str] = []
    report = run_checks(CHECKS, lambda result: seen.append(result.name))
    assert seen == [check.name for check in CHECKS]
    assert [r.status for r in report.results] == [
        "passed",
        "failed",
        "passed",
        "failed",
        "inconclusive",
        "not_applicable",
    ]
    assert [r.message for r in report.failed] == ["it is 3 instead of 2", "ZeroDivisionError: by zero"]
    assert [r.message for r in report.inconclusive] == ["nothing moved"]
    assert not report.ok
    assert run_checks(CHECKS[:1]).ok


def test_a_capability_counts_only_if_all_its_checks_passed() -> None:
    assert run_checks(CHECKS).verified_capabilities == ("rays",)


def test_a_report_is_json() -> None:
    told = json.loads(json.dumps(run_checks(CHECKS).as_dict()))
    assert told["ok"] is False
    assert told["verified_capabilities"] == ["rays"]
    assert {"python", "frobs-core", "gymnasium"} <= told["versions"].keys()
    assert told["checks"][1]["name"] == "bad"


def test_pytest_shows_each_check_by_its_name() -> None:
    test = pytest_checks(CHECKS, expected_failures={"bad": "not yet"})
    (mark,) = test.pytestmark  # type: ignore[attr-defined]
    cases = mark.args[1]
    assert [case.id for case in cases] == [check.name for check in CHECKS]
    assert [case.id for case in cases if case.marks] == ["bad"]
    assert cases[1].marks[0].kwargs == {"reason": "not yet", "strict": True}


def test_an_expected_failure_of_no_check_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'good'"):
        pytest_checks(CHECKS, expected_failures={"goood": "a slip"})


def test_inconclusive_checks_are_skipped_or_fail() -> None:
    with pytest.raises(pytest.skip.Exception, match="inconclusive: nothing moved"):
        pytest_checks(CHECKS)(CHECKS[4])
    with pytest.raises(pytest.fail.Exception, match="inconclusive: nothing moved"):
        pytest_checks(CHECKS, allow_inconclusive=False)(CHECKS[4])
    with pytest.raises(pytest.skip.Exception, match="not applicable: no lidar"):
        pytest_checks(CHECKS, allow_inconclusive=False)(CHECKS[5])


def test_an_expected_failure_must_fail() -> None:
    report = run_checks(CHECKS, expected_failures={"bad": "not yet", "good": "a rumour"})
    status = {result.name: (result.status, result.message) for result in report.results}
    assert status["bad"] == ("expected_failure", "not yet: it is 3 instead of 2")
    assert status["good"] == ("failed", "the check passes, but was expected to fail: a rumour")
    assert run_checks(CHECKS[1:2], expected_failures={"bad": "not yet"}).ok
    with pytest.raises(UnknownNameError, match="Did you mean 'good'"):
        run_checks(CHECKS, expected_failures={"goood": "a slip"})


def test_versions_name_the_plugins_and_what_they_require() -> None:
    assert {"frobs-sim-mujoco", "mujoco", "frobs-algos-sb3", "torch"} <= run_checks([]).versions.keys()


def test_a_check_is_skipped_where_one_that_it_requires_has_failed() -> None:
    checks = [CHECKS[1], Check("next", "It follows.", lambda: None, requires=("bad",)).under("part"), *CHECKS[:1]]
    assert [result.status for result in run_checks(checks).results] == ["failed", "passed", "passed"]
    checks = [
        CHECKS[1].under("part"),
        Check("next", "It follows.", crash, requires=("bad",)).under("part"),
        Check("last", "It follows that.", crash, requires=("next",)).under("part"),
    ]
    report = run_checks(checks)
    assert [result.status for result in report.results] == ["failed", "skipped", "skipped"]
    assert report.results[1].message == "part.bad failed"


def test_a_failure_with_the_message_of_another_is_skipped() -> None:
    report = run_checks([CHECKS[3], Check("again", "It raises the same.", crash), CHECKS[1]])
    assert [result.status for result in report.results] == ["failed", "skipped", "failed"]
    assert report.results[1].message == "the check fails for the same reason as broken"


def test_pytest_skips_what_requires_a_check_that_failed() -> None:
    following = Check("next", "It follows.", crash, requires=("bad",))
    test = pytest_checks([CHECKS[1], following])
    with pytest.raises(CheckFailure):
        test(CHECKS[1])
    with pytest.raises(pytest.skip.Exception, match="bad failed"):
        test(following)

import json
from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import Result

from frobs_core import testing
from frobs_core.testing import Check, CheckFailure, Hollow, NotApplicable

Frobs = Callable[..., Result]


def _fail() -> None:
    raise CheckFailure("expected [0, 1], was 2")


def _crash() -> None:
    raise ZeroDivisionError("by zero")


PASSES = Check("it_holds", "It holds.", lambda: None)
HOLLOW = Check("it_saw_nothing", "It saw nothing.", lambda: Hollow("no episode ended"))
OTHER = Check("it_is_not_meant", "It is not meant.", lambda: NotApplicable("no goal"))
FAILS = Check("it_breaks", "It breaks.", _fail)
CRASHES = Check("it_crashes", "It crashes.", _crash)


@pytest.fixture
def checks(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Put other checks in the place of the kit's."""

    def put(*found: Check) -> None:
        monkeypatch.setattr(testing, "check_env", lambda _: list(found))

    return put


def test_all_is_well(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(PASSES, HOLLOW, OTHER)
    result = frobs("check", "CartPole-v1")
    assert result.exit_code == 0
    assert "✓ it holds" in result.stdout
    assert "○ it saw nothing" in result.stdout
    assert "no episode ended" in result.stdout
    assert result.stdout.splitlines()[-1] == "1 passed, 1 hollow, 1 not applicable"


def test_a_failure_is_shown_and_the_others_go_on(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(FAILS, CRASHES, PASSES)
    result = frobs("check", "CartPole-v1")
    assert result.exit_code == 1
    assert result.stderr == ""
    assert "✗ it breaks" in result.stdout
    assert "    expected [0, 1], was 2" in result.stdout
    assert "    ZeroDivisionError: by zero" in result.stdout
    assert result.stdout.splitlines()[-1] == "1 passed, 2 failed"


def test_json_has_every_check(frobs: Frobs, checks: Callable[..., None]) -> None:
    checks(FAILS, PASSES)
    result = frobs("check", "CartPole-v1", "--json")
    found: dict[str, Any] = json.loads(result.stdout)
    assert result.exit_code == 1
    assert (found["id"], found["ok"]) == ("CartPole-v1", False)
    assert [(check["name"], check["status"]) for check in found["checks"]] == [
        ("it_breaks", "failed"),
        ("it_holds", "passed"),
    ]

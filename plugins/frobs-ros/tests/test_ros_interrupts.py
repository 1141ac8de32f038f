from __future__ import annotations

import pytest

from frobs_ros import interrupts


@pytest.fixture(autouse=True)
def uninterrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "_was_interrupted", False)


def shut_down(reason: str) -> None:
    """Step as an environment does whose node is shut down meanwhile."""
    with interrupts.interruptible():
        interrupts._note(reason)
        raise OSError("the connection is gone")


def test_signal_that_shut_the_node_down_replaces_the_errors_that_follow() -> None:
    with pytest.raises(KeyboardInterrupt):
        shut_down("signal-2")


def test_nothing_begins_after_a_signal_has_shut_the_node_down() -> None:
    interrupts._note("signal-15")
    with pytest.raises(KeyboardInterrupt), interrupts.interruptible():
        pytest.fail("it began although the node is gone")


def test_shutdown_by_the_script_interrupts_nothing() -> None:
    with pytest.raises(OSError, match="gone"):
        shut_down("closing")

import io

import pytest
from rich.console import Console

from frobs_train import Progress
from frobs_train.cli import training_report as progress
from frobs_train.cli.training_report import TrainingProgress


def _at(steps: int, success: float | None = 0.5) -> Progress:
    return Progress(
        steps=steps,
        total_steps=1000,
        elapsed=steps / 100,
        steps_per_second=100.0,
        seconds_left=(1000 - steps) / 100,
        reward=-1.5,
        length=50.0,
        success=success,
    )


def _shown(monkeypatch: pytest.MonkeyPatch, *, terminal: bool) -> io.StringIO:
    out = io.StringIO()
    made = Console(file=out, width=100, force_terminal=terminal, no_color=True, highlight=False)
    monkeypatch.setattr(progress, "console", lambda stderr: made)
    return out


def test_lines_where_there_is_no_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    out = _shown(monkeypatch, terminal=False)
    with TrainingProgress("training x", 1000) as shown:
        shown.update(_at(100))
        shown.update(_at(200))  # too soon after the last line
        shown.update(_at(1100))  # the last iteration may overshoot
    assert out.getvalue().splitlines() == [
        "training x",
        "100/1,000 steps (10 %) · 100 steps/s · success 50.0 % · reward -1.50 · 9.0 s left",
        "1,100/1,000 steps (100 %) · 100 steps/s · success 50.0 % · reward -1.50 · in 11 s",
    ]


def test_an_environment_that_does_not_say_has_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    out = _shown(monkeypatch, terminal=False)
    with TrainingProgress("training x", 1000) as shown:
        shown.update(_at(100, success=None))
    [_, line] = out.getvalue().splitlines()  # once, although it is both the first and the last one
    assert "success" not in line


def test_a_bar_in_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    out = _shown(monkeypatch, terminal=True)
    with TrainingProgress("training x", 1000) as shown:
        shown.update(_at(400))
    assert "training x" in out.getvalue()
    assert "40%" in out.getvalue()
    assert "6.0 s left" in out.getvalue()


def test_what_fails_before_it_begins_shows_no_headline(monkeypatch: pytest.MonkeyPatch) -> None:
    out = _shown(monkeypatch, terminal=False)
    with pytest.raises(ValueError, match="bad"), TrainingProgress("training x", 1000):
        raise ValueError("bad")
    assert out.getvalue() == ""

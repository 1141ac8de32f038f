from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import robustness


@pytest.mark.slow
def test_the_page_says_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robustness, "GRID", {(1.0, 1.0): robustness.model_error(1.0, 1.0)})
    monkeypatch.setattr(robustness, "HARDER", {"actions delayed by 2 steps": {"action_delay": {"steps": 2}}})
    rows = robustness.measure("tcp_delta_position", [3], episodes=4, steps=1024)
    assert [row["training"] for row in rows] == ["without", "with"]
    page = robustness.report([*rows, *({**row, "seed": 4, "nominal": 1.0} for row in rows)], episodes=4)
    assert "Training seeds: 3, 4; the tables show their mean" in page
    assert "| nominal | " in page
    assert "randomize:\n  mass:\n    scale:" in page

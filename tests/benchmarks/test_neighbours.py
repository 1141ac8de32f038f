from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import neighbours


def row(name: str, seed: int, *found: tuple[float, float]) -> dict[str, object]:
    moments = [{"steps": 500 * i, "seconds": s, "success": share} for i, (s, share) in enumerate(found, start=1)]
    return {"name": name, "seed": seed, "moments": moments, "machine": "one core", "commit": "abcdef0"}


def test_the_time_is_that_of_the_first_evaluation_that_finds_the_success() -> None:
    found = row("a", 0, (1.0, 0.5), (2.0, 0.96), (3.0, 0.94), (4.0, 0.98))
    assert neighbours.reached(found, 0.95) == 2.0
    assert neighbours.reached(found, 0.97) == 4.0
    assert neighbours.reached(found, 0.99) == float("inf")


def test_the_page_gives_medians_and_says_what_differs() -> None:
    rows = [row(neighbours.THEIRS, seed, (20.0 + seed, 0.95), (30.0 + seed, 0.98)) for seed in range(3)]
    rows += [row("FRobs", 0, (1.5, 0.99)), row("FRobs", 1, (2.5, 0.99)), row("FRobs", 2, (9.0, 0.5))]
    pushed = [row("panda-gym", 0, (290.0, 0.0), (1800.0, 0.1)), row("FRobs", 0, (100.0, 0.5), (700.0, 0.98))]
    page = neighbours.report(rows, {"push": pushed}, {"panda-gym, PandaPush-v3": 512.3}, 300)
    assert f"| {neighbours.THEIRS} | 21 s | 20 s, 21 s, 22 s | 31 s | 30 s, 31 s, 32 s |" in page
    assert "| FRobs | 2.5 s | 1.5 s, 2.5 s, never | 2.5 s | 1.5 s, 2.5 s, never |" in page
    assert "| panda-gym | 0% | 0% | 0% | 0% | 0% | 10% | 1,000 | 30 min |" in page
    assert "| FRobs | 50% | 50% | 98% | 98% | 98% | 98% | 1,000 | 12 min |" in page
    assert "| panda-gym, PandaPush-v3 | 512 |" in page
    assert "Machine: one core. Commit: abcdef0." in page
    assert all(word in page for word in ("goals", "reward", "algorithm", "hindsight experience replay"))


@pytest.mark.slow
def test_ours_is_timed_at_each_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "BUILD", tmp_path)
    found = neighbours.measure_ours(neighbours.OURS[0], seed=0, episodes=4, steps=6144)
    seconds = [moment["seconds"] for moment in found["moments"]]
    assert seconds == sorted(seconds)
    assert found["moments"][0]["steps"] >= 2048

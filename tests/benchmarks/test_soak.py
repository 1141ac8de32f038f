from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import soak


@pytest.mark.slow
def test_steps_and_lifetimes_are_sampled_and_reported(tmp_path: Path) -> None:
    parts = [soak.stored_part("steps", lambda: soak.steps("mujoco", 40), tmp_path), soak.lifetimes("mujoco", 2)]
    assert soak.stored_part("steps", lambda: parts[1], tmp_path) == parts[0]
    assert [item.count for item in parts[0].samples] == [*range(0, 41, 2)]
    assert [item.count for item in parts[1].samples] == [0, 1, 2]
    page = soak.report(parts)
    assert "## 40 steps of one environment on mujoco" in page
    assert f"| 2 | {parts[1].samples[-1].memory:.1f} MiB |" in page


@pytest.mark.slow
@pytest.mark.needs("rendering")
def test_steps_with_pictures_are_counted_over_all_environments() -> None:
    part = soak.pictures(100)
    assert [item.count for item in part.samples] == [0, 50, 100]
    assert part.title == "100 steps of 50 environments with pictures on mujoco"


@pytest.mark.slow
def test_contacts_of_random_steps_are_looked_at_and_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = soak.stored_contacts("frobs/PandaLift-v0", 10_000, tmp_path)
    monkeypatch.setattr(soak, "contacts", None)  # fails if the ID is checked again
    assert soak.stored_contacts("frobs/PandaLift-v0", 10_000, tmp_path) == found
    assert found.sound
    assert 0.0 < found.depth < 0.005
    assert len(soak.manipulation_ids()) >= 16
    page = soak.report([], [found, replace(found, depth=0.01)])
    assert f"| `frobs/PandaLift-v0` | 10,000 | 0 | 0 | {1000 * found.depth:.1f} mm |" in page
    assert "Not checked yet: `frobs/" in page
    assert "10.0 mm (**too deep**)" in page
    assert not replace(found, unreported=1).sound


def test_growth_after_the_warm_up_is_found() -> None:
    def part(last: soak.Sample) -> soak.Part:
        warm = [soak.Sample(0, 50.0, 5, 1), soak.Sample(10, 100.0, 7, 2)]
        return soak.Part("steps", "steps", [*warm, last])

    assert part(soak.Sample(100, 101.0, 7, 2)).constant
    assert not part(soak.Sample(100, 110.0, 7, 2)).constant
    assert not part(soak.Sample(100, 100.0, 8, 2)).constant
    assert not part(soak.Sample(100, 100.0, 7, 3)).constant

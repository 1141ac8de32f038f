from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import experts


def found(share: float) -> dict[str, object]:
    return {"success_rate": share, "success_interval": [share - 0.05, share], "commit": "abc1234"}


def test_the_page_marks_an_expert_that_succeeds_too_rarely() -> None:
    rows = {
        "frobs/PandaPush-v0": {"mujoco": found(0.985), "pybullet": found(0.895)},
        "frobs/PandaLift-v0": {"mujoco": found(0.975)},
    }
    page = experts.report(rows, 200)
    assert "| `frobs/PandaPush-v0` | 98.5% | 93.5% to 98.5% | 89.5% (missed) | 84.5% to 89.5% |" in page
    assert "| `frobs/PandaLift-v0` | 97.5% (missed) | 92.5% to 97.5% | not measured |  |" in page
    assert "Commit: abc1234." in page


@pytest.mark.slow
def test_a_measured_expert_is_not_measured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = experts.measure("frobs/PandaOpenDrawer-v0", "mujoco", 4, tmp_path)
    assert first["success_rate"] == 1.0
    monkeypatch.setattr(experts, "frobs", None)
    assert experts.measure("frobs/PandaOpenDrawer-v0", "mujoco", 4, tmp_path) == first

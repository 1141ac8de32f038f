from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import arms
from corpus import files

from frobs_train import resolve_config


def row(arm: str, controller: str, success: float) -> dict[str, object]:
    return {
        "controller": controller,
        "arm": arm,
        "steps": 150_528,
        "seconds": 90.0,
        "shared": True,
        "success_rate": success,
        "success_interval": (success - 0.01, success + 0.01),
        "commit": "abc1234",
    }


def test_every_arm_has_a_file_and_settings_for_each_controller() -> None:
    assert len(arms.ARMS) == 10
    assert {file for file, _ in arms.ARMS.values()} <= set(files())
    for controller in arms.WANTED:
        assert resolve_config(arms.ID, flags={"controller": controller}).total_envs > 8


def test_the_page_shows_each_arm_with_both_controllers() -> None:
    rows = [row("SO-101", "tcp_delta_position", 0.9), row("SO-101", "joint_delta_position", 0.84)]
    page = arms.report(rows, episodes=1000)
    assert "| SO-101 ‡ | `tcp_delta_position` | 150,528 | 1.5 min | 90.0% | 89.0% to 91.0% | abc1234 |" in page
    assert (
        "| SO-101 ‡ | `joint_delta_position` | 150,528 | 1.5 min | 84.0% (missed) | 83.0% to 85.0% | abc1234 |" in page
    )
    assert "The machine was shared" in page
    assert "The machine was shared" not in arms.report([{**rows[0], "shared": False}], episodes=1000)
    assert "Not measured yet: Franka Panda with `tcp_delta_position`, " in page
    assert "so_arm_description/urdf/so101.urdf` | `environment_kwargs.tcp=gripper_frame_link` |" in page


def test_the_record_is_of_the_arms_and_of_what_is_tuned() -> None:
    rows = json.loads(arms.RECORD.read_text("utf-8"))
    assert len({(row["arm"], row["controller"]) for row in rows}) == len(rows)
    for found in rows:
        assert found["arm"] in arms.ARMS
        steps = resolve_config(arms.ID, flags={"controller": found["controller"]}).steps
        assert steps <= found["steps"] < 1.05 * steps, "tuned again since: measure it again"


@pytest.mark.slow
def test_a_result_is_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = tmp_path / "record.json"
    first = arms.measure("tcp_delta_position", "KUKA iiwa", episodes=4, steps=1024, record=record)
    assert first["steps"] == 1024
    monkeypatch.setattr(arms, "train", None)  # fails if an arm is trained again
    again = arms.measure("tcp_delta_position", "KUKA iiwa", episodes=4, steps=1024, record=record)
    assert again == {**first, "success_interval": list(first["success_interval"])}

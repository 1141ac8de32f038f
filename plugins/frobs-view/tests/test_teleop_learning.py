"""A policy learns from episodes in which the handle was dragged."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.contracts import Pacer
from frobs_core.plugins.records import PolicyRecord
from frobs_train import evaluate, open_policy, resolve_config, train
from frobs_view import Teleop, ViewServer

frobs_data = pytest.importorskip("frobs_data")
pytest.importorskip("frobs_algos_imitation")

pytestmark = pytest.mark.slow

LIFT = "frobs/PandaLift-v0"
EPISODES = 20


class Dragged(Teleop):
    """A script that drags the handle above the cube, down to it, and up again, and closes the gripper in between."""

    def bind(self, env: Any) -> None:
        super().bind(env)
        self.task: Any = env.unwrapped.task
        self.phase = self.age = 0

    def act(self, observation: Any, episode_start: Any) -> Any:
        tool, grip, up = self.task.tool.pos[0].copy(), self.task.grip[0].copy(), np.array([0.0, 0.0, 1.0])
        if episode_start[0]:
            self._restart()
            self.phase = self.age = 0
        if self.phase == 0 and np.abs((grip - tool)[:2]).max() < 0.01:
            self.phase = 1
        if self.phase == 1 and np.abs(grip - tool).max() < 0.008:
            self.phase, self.held = 2, tool
            self._choose(("gripper",))
        self.age += self.phase == 2
        lift = 0.12 * up if self.age > 8 else 0.0
        place = (grip + 0.08 * up, grip, None)[self.phase]
        self._dragged = (self.held + lift if place is None else place), np.array([1.0, 0.0, 0.0, 0.0])
        return super().act(observation, np.zeros(1, bool))

    def command(self) -> str:
        if "start" in self._offered:
            return "start"
        has_ended = self._status is not None and "has ended" in self._status.content
        return "keep" if has_ended or self.task.is_success()[0] else ""


def test_a_policy_learns_from_dragging(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    record = PolicyRecord(name="dragged", summary="", entry_point=f"{__name__}:Dragged")
    found = plugins.get_record
    monkeypatch.setattr(plugins, "get_record", lambda kind, name: record if name == "dragged" else found(kind, name))
    monkeypatch.setattr(ViewServer, "has_clients", True)
    monkeypatch.setattr(Pacer, "wait", lambda self, duration: None)
    folder = tmp_path / "lift"
    dataset = frobs_data.record(LIFT, "dragged", episodes=EPISODES, out=folder, success_only=True)
    assert len(dataset.episodes) == EPISODES
    settings = {"demonstrations": folder, "history": 4, "net_arch": "[128, 128]", "batch_size": 128}
    config = resolve_config(
        LIFT,
        flags={"algorithm": "bc", "seed": 0, "num_envs": 1, "steps": 2000},
        settings=[f"algorithm_config.{name}={value}" for name, value in settings.items()],
    )
    learned = evaluate(train(config, tmp_path / "run"), episodes=20)
    by_chance = evaluate(open_policy(LIFT, "random"), episodes=20)
    assert by_chance.success_rate is not None
    assert learned.success_rate is not None
    assert learned.success_rate >= by_chance.success_rate + 0.2

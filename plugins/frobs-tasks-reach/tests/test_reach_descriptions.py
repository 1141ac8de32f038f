"""What the tasks say about themselves, for lists and pages, is what they do."""

from __future__ import annotations

import gymnasium as gym
import pytest

from frobs_core import plugins
from frobs_core.plugins import registry
from frobs_core.plugins.records import TaskRecord

TASKS = [record for record in plugins.records("task").values() if record.entry_point.startswith("frobs_tasks_reach")]
CASES = [
    (id, reward_type)
    for id, (task, record) in registry.environments().items()
    if task in TASKS and record.robot
    for reward_type in task.load().reward_types
]


@pytest.mark.parametrize(("id", "reward_type"), CASES, ids=[f"{id}-{reward_type}" for id, reward_type in CASES])
def test_every_reward_term_is_explained(id: str, reward_type: str) -> None:
    env = gym.make(id, reward_type=reward_type)
    env.reset(seed=0)
    info = env.step(env.action_space.sample())[-1]
    meanings = env.unwrapped.task.reward_meanings  # type: ignore[attr-defined]
    env.close()
    names = {key.removeprefix("frobs/reward/") for key in info if key.startswith("frobs/reward/")}
    assert names
    assert {name for name in names if not meanings.get(name)} == set()


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_the_success_rule_is_part_of_a_sentence(task: TaskRecord) -> None:
    rule = task.load().success_rule
    assert rule
    assert rule[0].islower()
    assert not rule.endswith(".")

"""``compute_reward`` forgets the reward for precision, so hindsight replay learns another reward than the task's."""

from __future__ import annotations

from dataclasses import replace

from frobs_core.contracts import GoalTask
from templates.my_reach import MyReach, distance_to


class Faulty(MyReach, GoalTask):
    def observation_terms(self):
        terms = super().observation_terms()
        keys = {"tcp_position": "achieved_goal", "goal": "desired_goal"}
        return {name: replace(term, key=keys.get(name, term.key)) for name, term in terms.items()}

    def compute_reward(self, achieved_goal, desired_goal, info):
        return -distance_to(desired_goal, achieved_goal)

"""FRobs_RL's reaching task with joint velocity control, which has a different reward."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from frobs_core.contracts import StepContext
from frobs_core.description import ObservationTerm
from frobs_core.util.arrays import Floats, Mask
from frobs_tasks_legacy.reach.task import ReachLegacy


class ReachLegacyVelocity(ReachLegacy):
    """FRobs_RL's IRB 140 reaching task with joint velocity control, for comparisons and for porting FRobs_RL projects.

    By default, the goal moves. Episodes never terminate. The task has the same parameters as
    :class:`frobs_tasks_legacy.reach.task.ReachLegacy` and differs from ``ReachLegacy`` as follows:

    - An action of ±1 corresponds to ±0.2 rad/s for each joint. Therefore, the registered environment uses the
      controller ``joint_velocity`` with ``max_velocity=0.2``, and the key ``limit_joint_vel`` is ignored. A joint stops
      at its limit, not 0.09 rad before the limit as in FRobs_RL.
    - The control timestep is 0.1 s. Steps in FRobs_RL had no fixed duration.
    - The observation, (dof + 6) float32, consists of the joint positions, the goal [m], and the unit vector from the
      tool to the goal.
    - The reward is ``reached_goal_reward`` if the tool is within the tolerance of the goal, and otherwise
      ``−multiplier_dist_reward`` · distance. If a joint is within ``limit_margin`` (0.09 rad) of a limit or beyond the
      limit, ``joint_limits_reward`` is subtracted. The parameter ``step_reward`` has no effect.
    """

    success_rule: ClassVar[str] = "the tool is within tolerance_goal_pos of the goal at the time limit"
    reward_meanings: ClassVar[Mapping[str, str]] = {
        "reached_goal": "reached_goal_reward if the tool is within the tolerance of the goal, otherwise 0",
        "distance": "−multiplier_dist_reward · d outside the tolerance; d is the distance from tool to goal",
        "joint_limits": "−joint_limits_reward if a joint is within limit_margin of one of its limits",
    }
    control_timestep: ClassVar[float] = 0.1
    usual_profile: ClassVar[str] = "irb140_velocity"
    usual_limit_margin: ClassVar[float] = 0.09

    def reward(self, context: StepContext) -> Floats:
        """Return the reward of each environment, (num_envs,)."""
        super().reward(context)
        terms = self._reward_terms
        self._reward_terms = {
            "reached_goal": terms["reached_goal"],
            "distance": terms["distance"],
            "joint_limits": -terms["joint_limits"],
        }
        return sum(self._reward_terms.values(), np.zeros(self._robot.num_envs))

    def is_terminated(self) -> Mask | None:
        """Return None, because episodes never terminate, even if the goal does not move."""
        return None

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the joint positions, the goal, and the direction to the goal."""
        known = super().observation_terms()
        return {name: known[name] for name in ("joint_positions", "goal", "goal_direction")}

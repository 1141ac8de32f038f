"""FRobs_RL's reaching task with joint velocity control, which has a different reward."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

from frobs_core.description import ObservationTerm, Rewards
from frobs_core.util.arrays import Mask
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
    - The term ``step`` is missing, the sign of ``joint_limits`` is reversed, and ``limit_margin`` is 0.09 rad:

    {rewards}
    """

    success_rule: ClassVar[str] = "the tool is within tolerance_goal_pos of the goal at the time limit"
    rewards: ClassVar[Rewards] = {
        "dense": {
            "reached_goal": ReachLegacy.rewards["dense"]["reached_goal"],
            "distance": ReachLegacy.rewards["dense"]["distance"],
            "joint_limits": replace(ReachLegacy.rewards["dense"]["joint_limits"], weight="-joint_limits_reward"),
        }
    }
    control_timestep: ClassVar[float] = 0.1
    usual_profile: ClassVar[str] = "irb140_velocity"
    usual_limit_margin: ClassVar[float] = 0.09

    def is_terminated(self) -> Mask | None:
        """Return None, because episodes never terminate, even if the goal does not move."""
        return None

    def observation_terms(self) -> Mapping[str, ObservationTerm]:
        """Return the observation terms for the joint positions, the goal, and the direction to the goal."""
        known = super().observation_terms()
        return {name: known[name] for name in ("joint_positions", "goal", "goal_direction")}

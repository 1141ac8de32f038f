"""Template for a task environment: its spaces, actions, observations, rewards and termination condition.

After copying this template, change the environment ID, the class name and the base class.
"""

from typing import Any

from gymnasium.envs.registration import register, registry

from frobs_rl.templates import CustomRobotEnv

__all__ = ["CCustomTaskEnv", "CustomTaskEnv"]

if "CustomTaskEnv-v0" not in registry:
    register(
        id="CustomTaskEnv-v0", entry_point="frobs_rl.templates.CustomTaskEnv:CustomTaskEnv", max_episode_steps=10000
    )


class CustomTaskEnv(CustomRobotEnv.CustomRobotEnv):
    """Task environment whose base class defines the robot."""

    def __init__(self) -> None:
        super().__init__()
        # self.action_space = spaces.Box(…); self.observation_space = spaces.Box(…)
        # create the task's publishers and subscribers here

    def _set_episode_init_params(self) -> None:
        """Begin an episode by placing the robot and choosing a goal."""
        raise NotImplementedError

    def _send_action(self, action: Any) -> None:
        """Send an action to the robot."""
        raise NotImplementedError

    def _get_observation(self) -> Any:
        """Return the observation."""
        raise NotImplementedError

    def _get_reward(self) -> float:
        """Return the reward for the current step."""
        raise NotImplementedError

    def _check_if_done(self) -> bool:
        """Return whether the episode ends. On success, also set ``self.info["is_success"] = 1.0``."""
        raise NotImplementedError


CCustomTaskEnv = CustomTaskEnv

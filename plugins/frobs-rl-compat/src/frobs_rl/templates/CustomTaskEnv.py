"""Template of a task's environment: spaces, actions, observations, rewards, and the end of an episode.

To copy it, change the ID, the name of the class and its base class.
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
    """A task for the robot of its base class."""

    def __init__(self) -> None:
        super().__init__()
        # self.action_space = spaces.Box(…); self.observation_space = spaces.Box(…)
        # create publishers and subscribers of the task here

    def _set_episode_init_params(self) -> None:
        """Begin an episode: place the robot, and choose a goal."""
        raise NotImplementedError

    def _send_action(self, action: Any) -> None:
        """Send an action to the robot."""
        raise NotImplementedError

    def _get_observation(self) -> Any:
        """Return the observation."""
        raise NotImplementedError

    def _get_reward(self) -> float:
        """Return the reward of the step."""
        raise NotImplementedError

    def _check_if_done(self) -> bool:
        """Return whether the episode ends here; on success, set ``self.info["is_success"] = 1.0``."""
        raise NotImplementedError


CCustomTaskEnv = CustomTaskEnv

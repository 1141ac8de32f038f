"""A FRobs environment with the observations and infos that LeRobot expects. This module does not need LeRobot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import gymnasium as gym
import numpy as np

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.errors import ConfigurationError

GYM_ID = "lerobot_env_frobs/Environment-v0"
"""Gymnasium ID of all FRobs environments in LeRobot's format. The keyword ``task`` chooses the FRobs ID."""

gym.register(GYM_ID, entry_point="lerobot_env_frobs.environment:make")

STATE, ENVIRONMENT_STATE, PIXELS = "agent_pos", "environment_state", "pixels"
"""Keys of an observation in LeRobot's environments."""


def make(
    task: str,
    cameras: Sequence[str] = (),
    image_size: Sequence[int] = (96, 96),
    fps: int = 0,
    episode_length: int = 0,
    end_on_success: bool = True,
    kwargs: Mapping[str, Any] | None = None,
    render_mode: str | None = "rgb_array",
) -> LeRobotEnv:
    """Make an environment.

    Args:
        task: Gymnasium ID, with or without ``frobs/``.
        cameras: Names of the cameras of the scene whose pictures are added to the observation.
        image_size: Height and width of the pictures [pixels].
        fps: Control steps per second, or 0 for the rate of the task.
        episode_length: Maximum number of steps of an episode, or 0 for the one of the ID.
        end_on_success: Whether the first success ends an episode.
        kwargs: Further keywords of the environment, such as ``{"simulator": "pybullet"}``.
        render_mode: Render mode of the environment.

    Raises:
        UnknownNameError: A camera or another part does not exist.
        ConfigurationError: A value is invalid, or the actions are not vectors.
    """
    keywords = dict(kwargs or {})
    pictures = {name: {"camera": name, "size": list(image_size)} for name in cameras}
    name = task if "/" in task else f"frobs/{task}"
    spec, given = gym.registry.get(name), keywords.get("observations")
    own = spec.kwargs.get("observations", {}) if spec else {}  # a keyword would replace it
    keywords["observations"] = {**own, **pictures} if given is None else {**pictures, **given}
    if fps:
        keywords.setdefault("control_timestep", 1.0 / fps)  # fps is rounded if LeRobot read it from the environment
    if episode_length:
        keywords["max_episode_steps"] = episode_length
    id = f"frobs_core:{name}"  # importing frobs_core registers the IDs
    return LeRobotEnv(gym.make(id, render_mode=render_mode, disable_env_checker=True, **keywords), end_on_success)


class LeRobotEnv(gym.Wrapper[dict[str, Any], Any, Any, Any]):
    """A single FRobs environment in the format of LeRobot.

    An observation contains ``agent_pos``, which the robot measures itself, and ``environment_state``, all other vectors
    with the goals; both are float32. ``pixels`` contains the pictures by name, (height, width, 3) uint8. Entries without
    terms are omitted. Info contains ``is_success`` as a bool at each reset and step.

    Args:
        env: The environment, whose innermost environment is a :class:`frobs_core.kernel.env.RobotEnv`.
        end_on_success: Whether the first success ends an episode. Otherwise ``is_success`` is True only at the last step
            of an episode, so that LeRobot reports the success rate that ``frobs evaluate`` reports.

    Attributes:
        task, task_description: What to do, as a sentence for policies that read language.

    Raises:
        ConfigurationError: The actions are not vectors.
    """

    def __init__(self, env: gym.Env[Any, Any], end_on_success: bool) -> None:
        super().__init__(env)
        robot_env = cast("RobotEnv", env.unwrapped)
        space = env.action_space
        if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
            raise ConfigurationError(
                f"LeRobot requires actions that are vectors, but the action space is {space}; choose another controller."
            )
        self._end_on_success = end_on_success
        self._max_episode_steps = env.spec.max_episode_steps if env.spec else None  # LeRobot reads it
        # Without this attribute, LeRobot would read the task object of FRobs, which cannot be sent between processes.
        self.task = self.task_description = robot_env.task.instruction
        terms, self._columns = robot_env.observations.terms, robot_env.observations.columns
        vectors = {name: term.proprioceptive for name, term in terms.items() if term.is_vector}
        parts = {
            STATE: [name for name, proprioceptive in vectors.items() if proprioceptive],
            ENVIRONMENT_STATE: [name for name, proprioceptive in vectors.items() if not proprioceptive],
        }
        self._parts = {part: names for part, names in parts.items() if names}
        self._pictures = [name for name, term in terms.items() if term.dtype == "uint8"]
        spaces: dict[str, gym.Space[Any]] = {}
        for part, names in self._parts.items():
            low, high = (np.concatenate([getattr(terms[name], end) for name in names]) for end in ("low", "high"))
            spaces[part] = gym.spaces.Box(low.astype(np.float32), high.astype(np.float32))
        if self._pictures:
            spaces[PIXELS] = gym.spaces.Dict(
                {name: gym.spaces.Box(0, 255, terms[name].low.shape, np.uint8) for name in self._pictures}
            )
        self.observation_space = gym.spaces.Dict(spaces)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode. The options of LeRobot itself, ``lerobot_…``, are ignored."""
        own = {name: value for name, value in (options or {}).items() if not name.startswith("lerobot_")}
        observation, info = self.env.reset(seed=seed, options=own)
        return self._convert(observation), {**info, "is_success": False}

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one control step."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        success = info["is_success"] > 0.0
        if self._end_on_success:
            terminated = terminated or success
        else:
            success = success and (terminated or truncated)
        return self._convert(observation), float(reward), terminated, truncated, {**info, "is_success": success}

    def _convert(self, observation: Any) -> dict[str, Any]:
        def value(name: str) -> Any:
            key, columns = self._columns[name]
            return (observation[key] if isinstance(observation, dict) else observation)[columns]

        converted: dict[str, Any] = {
            part: np.concatenate([value(name) for name in names]) for part, names in self._parts.items()
        }
        if self._pictures:
            converted[PIXELS] = {name: value(name) for name in self._pictures}
        return converted

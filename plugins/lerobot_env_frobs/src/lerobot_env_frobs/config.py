"""The environment type ``frobs`` of LeRobot. This module imports LeRobot."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, cast

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

from lerobot_env_frobs.environment import ENVIRONMENT_STATE, GYM_ID, PIXELS, STATE, make

_NAMES = {ACTION: ACTION, STATE: OBS_STATE, ENVIRONMENT_STATE: OBS_ENV_STATE}
_KINDS = {ACTION: FeatureType.ACTION, STATE: FeatureType.STATE, ENVIRONMENT_STATE: FeatureType.ENV}


@EnvConfig.register_subclass("frobs")
@dataclass
class FrobsEnv(EnvConfig):
    """Settings of a FRobs environment in LeRobot, ``--env.NAME=VALUE``.

    The features are read from the environment. Their names equal those in data sets that ``frobs record`` writes.

    Args:
        task: Gymnasium ID, with or without ``frobs/``.
        fps: Control steps per second, or 0 for the rate of the task.
        features: Shape of each feature. The environment's values replace given values.
        features_map: LeRobot's name of each feature. The environment's values replace given values.
        episode_length: Maximum number of steps of an episode, or 0 for the one of the ID.
        cameras: Names of cameras of the scene, separated by commas, whose pictures are added to the observation.
        image_size: Height and width of the pictures [pixels].
        simulator: Name of the simulator.
        end_on_success: Whether the first success ends an episode. If False, an episode counts as a success only if its
            last step does.
        kwargs: Further keywords of the environment, such as ``{robot: ur5_gripper}``.
    """

    task: str | None = "PandaPickAndPlace-v0"
    fps: int = 0
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(default_factory=dict)
    episode_length: int = 0
    cameras: str = ""
    image_size: list[int] = field(default_factory=lambda: [96, 96])
    simulator: str = "mujoco"
    end_on_success: bool = True
    kwargs: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Read the features from the environment, which takes a few seconds.

        Raises:
            FrobsError: The environment cannot be built with these settings.
        """
        with closing(make(**{**self.gym_kwargs, "render_mode": None})) as env:
            self.fps = env.metadata["render_fps"]
            spaces: dict[str, Any] = {ACTION: env.action_space, **cast("Any", env.observation_space)}
        pictures = spaces.pop(PIXELS, {})
        self.features = {key: PolicyFeature(_KINDS[key], space.shape) for key, space in spaces.items()}
        self.features_map = {key: _NAMES[key] for key in spaces}
        for name, space in pictures.items():
            self.features[f"{PIXELS}/{name}"] = PolicyFeature(FeatureType.VISUAL, space.shape)
            self.features_map[f"{PIXELS}/{name}"] = f"{OBS_IMAGES}.{name}"

    @property
    def package_name(self) -> str:
        """Package that LeRobot imports to register the Gymnasium ID."""
        return "lerobot_env_frobs"

    @property
    def gym_id(self) -> str:
        """Gymnasium ID of all FRobs environments in LeRobot's format."""
        return GYM_ID

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Keywords of :func:`lerobot_env_frobs.environment.make`."""
        return {
            "task": self.task,
            "cameras": [name.strip() for name in self.cameras.split(",") if name.strip()],
            "image_size": self.image_size,
            "fps": self.fps,
            "episode_length": self.episode_length,
            "end_on_success": self.end_on_success,
            "kwargs": {"simulator": self.simulator, **self.kwargs},
        }

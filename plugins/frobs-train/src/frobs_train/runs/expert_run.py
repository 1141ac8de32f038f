"""Run the scripted expert of a task through the interface of a training run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from frobs_core.contracts import load_expert
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import RunError
from frobs_core.util.validation import validate
from frobs_core.util.yaml import merge
from frobs_train.configuration.config import RunConfig
from frobs_train.configuration.resolve import read_setting
from frobs_train.runs.run import Run


class ExpertRun(Run):
    """The scripted, untrained expert of an environment's task, used through the interface of a training run.

    Args:
        environment: Gymnasium ID.
        settings: Assignments to keys of :class:`frobs_train.RunConfig`, such as ``"environment_kwargs.robot=ur5"``.

    Raises:
        ConfigurationError: A setting is invalid.
    """

    def __init__(self, environment: str, settings: Sequence[str] = ()) -> None:
        given = merge({"environment": environment, "seed": 0}, *(read_setting(setting) for setting in settings))
        super().__init__(Path(environment), validate(RunConfig, given, "an expert"))


class ExpertPolicy:
    """The expert of an environment's task, with the ``predict`` method of an algorithm.

    Args:
        env: A single or vector environment.

    Raises:
        RunError: The environment's task has no expert.
        ConfigurationError: The expert does not support the environment's controllers.
    """

    def __init__(self, env: Any) -> None:
        bare = env.unwrapped
        expert = load_expert(bare) if isinstance(bare, RobotEnv | RobotVectorEnv) else None
        if expert is None:
            name = env.spec.id if env.spec is not None else type(bare).__name__
            raise RunError(f"the task of {name} has no scripted expert; use --pretrained, --model or a run folder.")
        self._expert = expert

    def predict(
        self, observation: Any, state: Any, episode_start: Mask, deterministic: bool = True
    ) -> tuple[Action, Any]:
        """Return actions, (num_envs, …), for the environment's current state, and return ``state`` unchanged."""
        return self._expert.act(episode_start), state

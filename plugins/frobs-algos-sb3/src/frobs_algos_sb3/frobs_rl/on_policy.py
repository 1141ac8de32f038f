"""PPO and A2C, which can begin with what imitation learning has learned."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from frobs_algos_sb3.frobs_rl.basic_model import BasicModel
from frobs_algos_sb3.frobs_rl.building import imitated_model
from frobs_algos_sb3.frobs_rl.config_files import DEFAULT_PACKAGE
from frobs_algos_sb3.frobs_rl.logs import OnExisting
from frobs_core.errors import MissingSettingError


class OnPolicyModel(BasicModel):
    """Base class of PPO and A2C.

    Args:
        env: See :class:`BasicModel`, as for all that is not said here.
        save_model_path: Folder of the models.
        log_path: Folder of the log folders.
        load_trained: Open a model for predictions.
        config_file_pkg: The package that holds the YAML file.
        config_filename: The YAML file.
        ns: Namespace on ROS's parameter server.
        load_il_policy: Begin with the policy at ``il_policy_path``.
        il_policy_path: A model of the same algorithm, as imitation learning has saved it.
        on_existing: What to do about a log folder that exists.
        trust: Open models that could execute code.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any] | VecEnv | None,
        save_model_path: Path | str,
        log_path: Path | str | None = None,
        load_trained: bool = False,
        config_file_pkg: str | None = DEFAULT_PACKAGE,
        config_filename: str | Path | None = None,
        ns: str = "/",
        *,
        load_il_policy: bool = False,
        il_policy_path: Path | str | None = None,
        on_existing: OnExisting = "error",
        trust: bool = False,
    ) -> None:
        if load_il_policy and il_policy_path is None:
            raise MissingSettingError("load_il_policy", "il_policy_path", "set it to the model to start from")
        self._il_policy = Path(il_policy_path) if load_il_policy and il_policy_path is not None else None
        super().__init__(
            env,
            save_model_path,
            log_path,
            load_trained,
            config_file_pkg,
            config_filename,
            ns,
            on_existing=on_existing,
            trust=trust,
        )

    def _make(self) -> BaseAlgorithm:
        if self._il_policy is None:
            return super()._make()
        assert self.settings is not None
        assert self.env is not None
        return imitated_model(self.settings, self.env, self._il_policy, self._trust)

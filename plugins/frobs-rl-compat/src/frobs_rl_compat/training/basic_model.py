"""The base class of FRobs_RL's six model classes."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, ClassVar, Self

import gymnasium as gym
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from frobs_algos_sb3.model_files import load_model, save_model, write_replay_buffer
from frobs_core.util.errors import ConfigurationError, MissingSettingError, RunError
from frobs_rl_compat.gym_api import to_gymnasium
from frobs_rl_compat.training.building import new_model, saved_model
from frobs_rl_compat.training.config_files import DEFAULT_PACKAGE, find_config
from frobs_rl_compat.training.logs import OnExisting, log_folder, make_logger
from frobs_rl_compat.training.parameters import current_parameters, load_parameters
from frobs_rl_compat.training.saving import NotTrainedError, SaveEvery, free_name
from frobs_rl_compat.training.settings import FileSettings, read_settings

_log = logging.getLogger("frobs")


class BasicModel:
    """Stable-baselines3 model that is configured by a YAML file, as in FRobs_RL.

    Each subclass sets ``algorithm``.

    Args:
        env: Any environment with Gymnasium's API or the old gym API, or a vector environment of stable-baselines3.
        save_model_path: Folder in which models are saved, or the model file if ``load_trained`` is set.
        log_path: Parent folder of the log folders.
        load_trained: Whether to open the model at ``save_model_path`` for predictions, without reading a YAML file and
            without logging.
        config_file_pkg: Name of the Python package or, if ROS is installed, the ROS package that contains the YAML
            file. If None, ``config_filename`` is a path.
        config_filename: Name of the YAML file, or None for ``<algorithm>_config.yaml``.
        ns: Namespace on ROS's parameter server, if a server is running.
        on_existing: What to do if the log folder already exists: ``error``, ``increment``, ``overwrite`` or ``resume``.
        trust: Whether to open models and replay buffers that could execute code.

    Attributes:
        model: The model of stable-baselines3.
        env: The environment.
        settings: Settings from the YAML file, or None if ``load_trained`` is set.
        log_folder: Log folder of this training run, or None until the folder is chosen.

    Raises:
        ConfigurationError: A key or value is invalid, or a package or file cannot be read.
        LogFolderExistsError: The log folder already exists. This error is also a ValueError.
        UntrustedFileError: Loading the model requires ``trust``.
        CheckpointError: The model file is damaged.
    """

    algorithm: ClassVar[str]

    model: BaseAlgorithm

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
        on_existing: OnExisting = "error",
        trust: bool = False,
    ) -> None:
        self.env: Any = to_gymnasium(env)
        self.settings: FileSettings | None = None
        self.log_folder: Path | None = None
        self._trust = trust
        self._ns = ns
        self._logging = False
        self._saved: tuple[Path, tuple[int, int]] | None = None
        if load_trained:
            spaces = (self.env.observation_space, self.env.action_space) if self.env is not None else None
            self.model = load_model(Path(save_model_path), spaces=spaces, algorithm=self.algorithm, trust=trust)
            return
        if self.env is None or log_path is None:
            raise MissingSettingError(type(self).__name__, "an environment and a log_path")
        path = find_config(config_file_pkg, config_filename or f"{self.algorithm}_config.yaml")
        self._parameters = load_parameters(path, ns)
        self.settings = read_settings(self._parameters, self.algorithm, path)
        for key in self.settings.unused:
            _log.warning("%s: ignored '%s', which is not a setting of %s.", path, key, type(self).__name__)
        self._models = Path(save_model_path)
        params = self.settings.params
        folder = log_folder(Path(log_path) / params.log_folder, on_existing)
        self.model = saved_model(self.settings, self.env, self._models, trust) if params.load_model else self._make()
        self.log_folder = folder  # set last, so that no folder is created if an error occurs earlier
        self.set_model_logger()

    @classmethod
    def load_trained(
        cls, model_path: Path | str, env: gym.Env[Any, Any] | VecEnv | None = None, *, trust: bool = False
    ) -> Self:
        """Open a trained model for predictions, without a YAML file or a log folder.

        Args:
            model_path: Path of the model file. The suffix ``.zip`` may be omitted.
            env: The environment. It is optional if ``trust`` is set, or if the JSON file that :meth:`save_model` writes
                is next to the model.
            trust: Whether to open a model that could execute code.

        Raises:
            CheckpointError: The file is missing or damaged, or it contains a model of another algorithm.
            UntrustedFileError: Opening the file requires ``trust``.
        """
        return cls(env, model_path, load_trained=True, trust=trust)

    def train(self) -> bool:
        """Train for ``training_steps`` more steps, and save the model.

        Returns:
            True.

        Raises:
            RunError: The model was opened for predictions.
        """
        params = self._training_settings().params
        callbacks: list[BaseCallback] = []
        if params.save_freq:
            callbacks.append(SaveEvery(params.save_freq, self._models, params.save_prefix, self._write))
        self.model.learn(
            params.training_steps,
            CallbackList(callbacks),
            log_interval=params.log_interval,
            reset_num_timesteps=params.reset_num_timesteps,
        )
        self.save_model()
        return True

    def save_model(self) -> Path:
        """Save the model as ``trained_model_name``, with the time appended if that file already exists.

        A model that has not been trained since it was last saved is not saved again. With ``save_replay_buffer``, the
        replay buffer is saved next to the model.

        Returns:
            The path of the file.

        Raises:
            RunError: The model was opened for predictions.
            OSError: The disk is full, or the folder cannot be written.
        """
        params = self._training_settings().params
        if self._saved is not None and self._saved[1] == self._learned and self._saved[0].is_file():
            return self._saved[0]
        path = free_name(self._models / f"{params.trained_model_name.removesuffix('.zip')}.zip")
        self._write(path)
        self._saved = (path, self._learned)
        _log.info("saved %s", path)
        if params.save_replay_buffer and isinstance(self.model, OffPolicyAlgorithm):
            self.save_replay_buffer()
        elif params.save_replay_buffer:
            _log.warning("%s has no replay buffer to save.", type(self).__name__)
        return path

    def save_replay_buffer(self) -> Path:
        """Save the replay buffer next to the last saved model, as plain arrays.

        Returns:
            The path of the file: ``<model>_replay_buffer.npz``.

        Raises:
            ConfigurationError: The algorithm has no replay buffer.
            NotTrainedError: No model has been trained and saved yet. This error is also a ValueError.
            OSError: The disk is full, or the folder cannot be written.
        """
        self._training_settings()
        if not isinstance(self.model, OffPolicyAlgorithm) or self.model.replay_buffer is None:
            raise ConfigurationError(
                f"{type(self).__name__} has no replay buffer, because it does not reuse old steps for learning."
            )
        if self._saved is None or self.model.replay_buffer.size() == 0:
            raise NotTrainedError("there is no replay buffer to save yet; call train() first.")
        path = self._saved[0].with_name(f"{self._saved[0].stem}_replay_buffer.npz")
        write_replay_buffer(self.model.replay_buffer, path)
        return path

    def set_model_logger(self) -> bool:
        """Log to stdout, ``progress.csv`` and TensorBoard in the log folder. A new model already logs there.

        Returns:
            True.

        Raises:
            RunError: The model was opened for predictions.
        """
        self._training_settings()
        assert self.log_folder is not None
        if not self._logging:
            self.model.set_logger(make_logger(self.log_folder))
            self._logging = True
        return True

    def check_env(self) -> bool:
        """Return whether the environment meets stable-baselines3's requirements, and log the reason if it does not."""
        from stable_baselines3.common.env_checker import check_env

        try:
            check_env(self.env, warn=True)
        except Exception as error:  # the environment's code can raise any exception
            _log.error("%s failed the environment check of stable-baselines3: %s", self.env, error)
            return False
        return True

    def close_env(self) -> bool:
        """Close the environment and the logs, and return True."""
        if self._logging:
            self.model.logger.close()
        if self.env is not None:
            self.env.close()
        return True

    def predict(
        self,
        observation: Any,
        state: tuple[np.ndarray[Any, Any], ...] | None = None,
        mask: np.ndarray[Any, Any] | None = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray[Any, Any], tuple[np.ndarray[Any, Any], ...] | None]:
        """Return the action for an observation.

        Args:
            observation: One observation or a batch.
            state: State of a recurrent policy.
            mask: For each environment, whether an episode begins. In stable-baselines3, this argument is called
                ``episode_start``.
            deterministic: Whether to return the most probable action instead of a sample.

        Returns:
            The action, and the next state of a recurrent policy.
        """
        return self.model.predict(observation, state=state, episode_start=mask, deterministic=deterministic)

    def _make(self) -> BaseAlgorithm:
        assert self.settings is not None
        return new_model(self.settings, self.env)

    def _write(self, path: Path) -> None:
        assert self.settings is not None
        params, config = self.settings.params.model_dump(mode="json"), self.settings.run_settings()
        save_model(self.model, path, {"frobs_rl": {"params": params, "algorithm_config": config}})

    def _training_settings(self) -> FileSettings:
        if self.settings is None:
            raise RunError("this model was loaded for prediction only; build it from a YAML file to train or save it.")
        mapping = current_parameters(self._parameters, self._ns)
        if mapping is not self._parameters:
            self.settings = read_settings(mapping, self.algorithm, f"the parameter server, {self._ns}")
        return self.settings

    @property
    def _learned(self) -> tuple[int, int]:
        """Return counters that change whenever the model learns."""
        return self.model.num_timesteps, int(getattr(self.model, "_n_updates", 0))

"""Names model files, and saves models during training."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from stable_baselines3.common.callbacks import BaseCallback

from frobs_core.util.errors import RunError
from frobs_rl_compat.training.config_files import missing


class NotTrainedError(RunError, ValueError):
    """The replay buffer cannot be saved before a model has been trained and saved. Also a ValueError."""


def free_name(path: Path) -> Path:
    """Return the path, with the time appended if the file exists: ``trained_model_31_12_2026_23_59_59.zip``."""
    if not path.exists():
        return path
    stem = f"{path.stem}_{datetime.now().strftime('%d_%m_%Y_%H_%M_%S')}"
    stamped, number = path.with_name(f"{stem}{path.suffix}"), 1
    while stamped.exists():
        number += 1
        stamped = path.with_name(f"{stem}_{number}{path.suffix}")
    return stamped


def existing_model(folder: Path, name: str) -> Path:
    """Return the path of the model to train further, or raise an error that lists the existing models."""
    path = folder / f"{name.removesuffix('.zip')}.zip"
    if not path.is_file():
        raise missing(
            f"load_model: {path} does not exist; set model_name to an existing model, or load_model to False.",
            name,
            sorted(file.stem for file in folder.glob("*.zip")),
        )
    return path


class SaveEvery(BaseCallback):
    """Callback that regularly saves the model as ``<prefix>_<steps>_steps.zip``.

    The ``save`` function writes the model to a given path.
    """

    def __init__(self, steps: int, folder: Path, prefix: str, save: Callable[[Path], None]) -> None:
        super().__init__()
        self._steps = steps
        self._folder = folder
        self._prefix = prefix
        self._save = save
        self._last = 0

    def _on_training_start(self) -> None:
        self._last = self.num_timesteps

    def _on_step(self) -> bool:
        if self.num_timesteps // self._steps > self._last // self._steps:
            self._save(self._folder / f"{self._prefix}_{self.num_timesteps}_steps.zip")
        self._last = self.num_timesteps
        return True

"""Reports training progress to the run's monitor."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from stable_baselines3.common.callbacks import BaseCallback

from frobs_core.contracts import TrainingMonitor


class Stopped(Exception):  # noqa: N818  # signals that the monitor ended training
    """Raised to end ``learn`` at the start of a rollout, where an interruption does not affect the results."""


class MonitorCallback(BaseCallback):
    """Callback that reports to the monitor at the start of each rollout.

    Training can be continued exactly only from a model that was saved at the start of a rollout.
    """

    def __init__(
        self, name: str, monitor: TrainingMonitor, begin: Callable[[], None], save: Callable[[Path, Path | None], None]
    ) -> None:
        super().__init__()
        self._name, self._monitor, self._save = name, monitor, save
        self._begin: Callable[[], None] | None = begin
        self._reported = -1
        self.at_start = False  # whether the algorithm is at the start of a rollout

    def _on_rollout_start(self) -> None:
        if self._begin is not None:
            self._begin()
            self._begin, self._reported = None, self.num_timesteps
            return
        if not self._monitor.is_due(self.num_timesteps):
            return
        self.at_start = True
        go_on = self.report()
        self._monitor.offer_checkpoint(self._reported, self._save)
        if not go_on:
            raise Stopped
        self.at_start = False

    def _on_step(self) -> bool:
        return True

    def report(self) -> bool:
        """Report the metrics collected since the last call, and return whether to continue."""
        self._reported = self.model.num_timesteps
        values = self.model.logger.name_to_value
        metrics = {f"{self._name}/{key.partition('/')[2]}": float(value) for key, value in values.items()}
        values.clear()
        self.model.logger.name_to_count.clear()
        self.model.logger.name_to_excluded.clear()
        return self._monitor.on_progress(self._reported, metrics)

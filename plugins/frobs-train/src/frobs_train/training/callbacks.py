"""Callbacks, which run user code during training."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from frobs_train.configuration.components import build_component, load_component
from frobs_train.errors import ComponentError

if TYPE_CHECKING:
    from frobs_train.configuration.config import ComponentConfig
    from frobs_train.runs.checkpoints import Checkpoint
    from frobs_train.runs.run import Run
    from frobs_train.training.monitor import Progress


class TrainingCallback:
    """Base class of callbacks. All methods do nothing by default.

    Add callbacks to the configuration with ``callbacks: [{name: "package.module:Class", keyword: …}]``. Checkpoints do
    not contain the state of callbacks. A resumed run creates new callbacks, and passes the number of environment steps
    taken so far to :meth:`on_start`.
    """

    def on_start(self, run: Run, steps: int) -> None:
        """Called when training begins or is resumed.

        Args:
            run: The run.
            steps: Number of environment steps already taken, which is 0 for a new run.
        """

    def on_progress(self, progress: Progress, row: Mapping[str, float | None]) -> bool | None:
        """Called after each row of the log.

        Args:
            progress: Progress of the training run.
            row: Values by column.

        Returns:
            False to write a checkpoint and end training.
        """
        return None

    def on_checkpoint(self, checkpoint: Checkpoint) -> None:
        """Called after a checkpoint has been written."""

    def on_end(self, run: Run, steps: int) -> None:
        """Called when training has ended without an interruption, after ``steps`` environment steps in total."""

    def close(self) -> None:
        """Release resources. Called last, even if training failed, was interrupted or never began."""


def build_callbacks(components: list[ComponentConfig]) -> list[TrainingCallback]:
    """Build the callbacks of a configuration."""
    built = []
    for component in components:
        callback = build_component(load_component(component.name, "callback"), (), component, "callback")
        if not isinstance(callback, TrainingCallback):
            raise ComponentError(
                "callback",
                component.name,
                f"creates a {type(callback).__name__} object; derive its class from frobs_train.TrainingCallback.",
            )
        built.append(callback)
    return built

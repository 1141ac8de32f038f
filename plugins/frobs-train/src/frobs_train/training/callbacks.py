"""What others may do while a run trains."""

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
    """Base class of callbacks: each method does nothing until a subclass says what.

    Named in the configuration as ``callbacks: [{name: "package.module:Class", keyword: …}]``. What it remembers is in
    no checkpoint: a run that is continued builds it anew, and says from where in :meth:`on_start`.
    """

    def on_start(self, run: Run, steps: int) -> None:
        """Take note that the training begins, or goes on.

        Args:
            run: The run.
            steps: Environment steps that were taken before; 0: it begins.
        """

    def on_progress(self, progress: Progress, row: Mapping[str, float | None]) -> bool | None:
        """Take note of a row of the log.

        Args:
            progress: How far the training is.
            row: Column to value.

        Returns:
            False ends the training, with a checkpoint.
        """
        return None

    def on_checkpoint(self, checkpoint: Checkpoint) -> None:
        """Take note of a checkpoint that was written."""

    def on_end(self, run: Run, steps: int) -> None:
        """Take note that the training has ended, and was not interrupted."""

    def close(self) -> None:
        """Release resources. Called last, also after an interruption or an error, and even if the training never began."""


def build_callbacks(components: list[ComponentConfig]) -> list[TrainingCallback]:
    """Build the callbacks of a configuration."""
    built = []
    for component in components:
        callback = build_component(load_component(component.name, "callback"), (), component, "callback")
        if not isinstance(callback, TrainingCallback):
            raise ComponentError(
                "callback",
                component.name,
                f"is a {type(callback).__name__}; derive it from frobs_train.TrainingCallback.",
            )
        built.append(callback)
    return built

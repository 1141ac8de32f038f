"""Handle an existing run folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from frobs_core.util.errors import RunError
from frobs_core.util.validation import choice
from frobs_train.configuration.config import RunConfig
from frobs_train.errors import RunExistsError
from frobs_train.runs.lock import RunLock
from frobs_train.runs.run import Run, is_run
from frobs_train.training.monitor import Progress
from frobs_train.training.resume import resume

ON_EXISTING = ("error", "increment", "overwrite", "resume")
"""Ways to handle an existing run folder."""


def check_existing(path: Path, on_existing: str) -> None:
    """Raise an error if ``on_existing`` does not allow a run in this folder, without changing any files."""
    choice("on_existing", on_existing, ON_EXISTING)
    if not path.exists() or on_existing == "increment":
        return
    if on_existing == "error":
        raise RunExistsError(path)
    if not is_run(path):
        raise RunError(
            f"{path} is not a run folder, because config.yaml or versions.json is missing; remove the folder manually."
        )
    if on_existing == "overwrite":
        with RunLock(path):  # check that no process is training in the folder
            pass


def resume_existing(path: Path, config: RunConfig, on_progress: Callable[[Progress], bool | None] | None) -> Run:
    """Continue a run with the same configuration, or extend the run to a larger number of steps."""
    run = Run.open(path)
    new, old = config.model_dump(), run.config.model_dump()
    if config.seed is None:
        new["seed"] = old["seed"]
    different = [key for key in new if key != "steps" and new[key] != old[key]]
    if different:
        changes = "; ".join(f"{key} is {old[key]} instead of {new[key]}" for key in different)
        raise RunError(f"{path} contains a run with a different configuration ({changes}); choose another --run-dir.")
    return resume(run, steps=config.steps if config.steps != run.config.steps else None, on_progress=on_progress)

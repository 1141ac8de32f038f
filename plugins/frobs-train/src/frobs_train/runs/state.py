"""State of a run in a checkpoint, excluding the algorithm and the environment. Reading the state executes no code."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from frobs_core.util.errors import CheckpointError
from frobs_core.util.files import read_json
from frobs_core.util.plain import to_json

FORMAT = 1
"""Version of the file format of ``run.json``."""

Arrays = Mapping[str, np.ndarray[Any, Any]]


@dataclass(frozen=True, kw_only=True)
class RunState:
    """State of a run at a checkpoint."""

    steps: int  # number of environment steps so far
    elapsed: float  # training time so far [s]
    metrics: Mapping[str, float | None] = field(
        default_factory=dict
    )  # metrics of the algorithm since the last row of the log; undefined metrics are None
    stopped: str | None = None  # reason why the training run ended early, or None
    exact: bool = False  # whether the snapshot contains the complete state of the environment
    format: int = FORMAT

    def write(self, folder: Path, episodes: Arrays) -> None:
        """Write ``run.json``, and the episode statistics to ``run.npz``."""
        (folder / "run.json").write_text(to_json(self, indent=2) + "\n", encoding="utf-8")
        write_arrays(folder / "run.npz", episodes)


def read_state(folder: Path) -> tuple[RunState, dict[str, np.ndarray[Any, Any]]]:
    """Read the files written by :meth:`RunState.write`."""
    path = folder / "run.json"
    try:
        values = read_json(path)
        if values.get("format") != FORMAT:
            raise CheckpointError(
                f"{path} does not have format version {FORMAT}; continue the run with the FRobs version that wrote "
                "the file."
            )
        state = TypeAdapter(RunState).validate_python(values)
    except OSError as error:
        raise CheckpointError(f"{path} cannot be read: {error.strerror}.") from error
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise CheckpointError(f"{path} is damaged: {'.'.join(map(str, first['loc']))}: {first['msg']}.") from error
    return state, read_arrays(folder / "run.npz")


def write_arrays(path: Path, arrays: Arrays) -> None:
    """Write named arrays to a file."""
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def read_arrays(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """Read a file written by :func:`write_arrays`."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise CheckpointError(f"{path} cannot be read: {error}.") from error


def write_best(folder: Path, steps: int, rank: tuple[float, float]) -> None:
    """Write ``best.json``, which contains the number of environment steps and the rank of the best policy."""
    (folder / "best.json").write_text(to_json({"steps": steps, "rank": rank}) + "\n", encoding="utf-8")


def read_best(folder: Path) -> tuple[int, tuple[float, float]]:
    """Return the number of environment steps and the rank, (success, reward), of the best policy."""
    path = folder / "best.json"
    try:
        values = read_json(path)
        success, reward = values["rank"]
        return int(values["steps"]), (float(success), float(reward))
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise CheckpointError(f"{path} cannot be read: {error}.") from error

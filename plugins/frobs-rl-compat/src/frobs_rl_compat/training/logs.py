"""Log folders of training runs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Literal, get_args

from stable_baselines3.common.logger import (
    CSVOutputFormat,
    HumanOutputFormat,
    KVWriter,
    Logger,
    TensorBoardOutputFormat,
    configure,
)

from frobs_core.util.errors import ParameterValueError, RunError

OnExisting = Literal["error", "increment", "overwrite", "resume"]
"""Ways to handle a log folder that already exists."""

_OURS = ("progress.csv", "events.out.tfevents.*")


class LogFolderExistsError(RunError, ValueError):
    """The log folder already exists. As in FRobs_RL, this is also a ValueError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(
            f"the log folder {path} already exists; change log_folder in the YAML file, or choose "
            "on_existing='increment' "
            "(use the next free name), 'overwrite' (delete the old logs) or 'resume' (append to the old logs)."
        )


def log_folder(path: Path, on_existing: str) -> Path:
    """Return the folder for the logs.

    If the folder exists, the result depends on ``on_existing``. With ``error``, LogFolderExistsError is raised. With
    ``increment``, the next free name is returned (``TD3_2`` after ``TD3_1``). With ``overwrite``, the folder's logs are
    removed. With ``resume``, new entries are appended to the logs.
    """
    if on_existing not in get_args(OnExisting):
        raise ParameterValueError("on_existing", on_existing, f"one of {', '.join(get_args(OnExisting))}")
    if on_existing == "increment":
        return _make_next(path)
    if not path.exists():
        return path
    if on_existing == "error":
        raise LogFolderExistsError(path)
    if on_existing == "overwrite":
        for pattern in _OURS:
            for file in path.glob(pattern):
                file.unlink()
    return path


def _make_next(path: Path) -> Path:
    """Create the first folder whose name is free, so that models created at the same time get different folders."""
    match = re.fullmatch(r"(.+)_(\d+)", path.name)
    stem, number = (match[1], int(match[2])) if match else (path.name, 0)
    while True:
        try:
            path.mkdir(parents=True)
            return path
        except FileExistsError:
            number += 1
            path = path.with_name(f"{stem}_{number}")


def make_logger(folder: Path) -> Logger:
    """Return a logger that writes to stdout, ``progress.csv`` and TensorBoard, and appends to existing files."""
    table = folder / "progress.csv"
    if not table.exists():
        return configure(str(folder), ["stdout", "csv", "tensorboard"])
    formats: list[KVWriter] = [HumanOutputFormat(sys.stdout), ContinuedCSV(table), TensorBoardOutputFormat(str(folder))]
    return Logger(str(folder), formats)


class ContinuedCSV(CSVOutputFormat):
    """CSV writer that, unlike stable-baselines3's writer, appends to an existing table.

    An incomplete last line is dropped.
    """

    def __init__(self, path: Path) -> None:
        text = path.read_text("utf-8")
        complete_lines = text[: text.rfind("\n") + 1]
        self.file = path.open("r+t", encoding="utf-8")
        self.file.truncate(len(complete_lines.encode()))
        self.file.seek(0, 2)
        self.keys = complete_lines.splitlines()[0].split(",") if complete_lines else []
        self.separator = ","
        self.quotechar = '"'

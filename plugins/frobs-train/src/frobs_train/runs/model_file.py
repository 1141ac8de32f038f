"""Use a model file of another library through the interface of a training run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym

from frobs_core import plugins
from frobs_core.contracts import Algorithm
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigurationError, MissingSettingError
from frobs_train.configuration.config import algorithm_record
from frobs_train.runs.policy_run import PolicyRun


class ModelFile(PolicyRun):
    """A model saved by an algorithm's library and used through the interface of a training run.

    The model cannot be trained further.

    Args:
        file: The model file. The suffix of the file determines which algorithms can read it.
        environment: Gymnasium ID of the environment in which the model acts.
        algorithm: Name of the algorithm. By default, the algorithm's name is read from the file.
        settings: Assignments to keys of :class:`frobs_train.RunConfig`, such as
            ``"environment_kwargs.controller=joint_position"``, ``"seed=3"`` or ``"wrappers=[…]"``.
        trust: Whether to open the file even if opening it executes code from the file.

    Attributes:
        path: The model file.

    Raises:
        ConfigurationError: No algorithm reads files of this type, or a setting is invalid.
        UnknownNameError: No algorithm has this name.
    """

    def __init__(
        self,
        file: Path | str,
        environment: str,
        algorithm: str | None = None,
        settings: Sequence[str] = (),
        trust: bool = False,
    ) -> None:
        path = Path(file)
        _opener(path, algorithm)
        super().__init__(path, environment, settings, algorithm=algorithm, trust=trust)
        self.path = path


def is_model_file(path: Path) -> bool:
    """Return whether an installed algorithm reads files with this suffix."""
    records = plugins.records(AlgorithmRecord)
    return not path.is_dir() and any(path.suffix in record.model_files for record in records.values())


def load_model_file(
    file: Path, observation_space: gym.Space[Any], action_space: gym.Space[Any], algorithm: str | None, trust: bool
) -> tuple[Algorithm, int]:
    """Load a model for the spaces of a single environment. For ``algorithm`` and ``trust``, see :class:`ModelFile`.

    The result is an object with ``predict`` and the spaces of an algorithm, and its number of training steps.
    """
    module, _, function = _opener(file, algorithm).partition(":")
    opener: Callable[..., tuple[Algorithm, int]] = getattr(import_module(module), function)
    return opener(file, observation_space, action_space, algorithm, trust)


def _opener(file: Path, algorithm: str | None) -> str:
    """Return the name of the function, defined in the algorithm's record, that opens a file."""
    records = plugins.records(AlgorithmRecord)
    if algorithm is not None:
        record = algorithm_record(algorithm)
        records = {record.name: record}
    found = {
        record.model_files[file.suffix]: name for name, record in records.items() if file.suffix in record.model_files
    }
    if len(found) == 1:
        return next(iter(found))
    if found:
        raise MissingSettingError(
            str(file), "--algorithm", f"several algorithms read files with this suffix: {', '.join(found.values())}, …"
        )
    suffixes = sorted({suffix for record in records.values() for suffix in record.model_files})
    owner = f"algorithm '{algorithm}' reads" if algorithm else "the installed algorithms read"
    raise ConfigurationError(f"{file}: {owner} only model files with these suffixes: {', '.join(suffixes) or 'none'}.")

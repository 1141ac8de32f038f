"""Open model files."""

from __future__ import annotations

import importlib.util
import io
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.her import HerReplayBuffer

from frobs_algos_sb3.model_files import known
from frobs_algos_sb3.model_files.archive import ModelArchive, clean_copy, read_archive
from frobs_algos_sb3.model_files.rebuild import Rebuilt, policy_kwargs, rebuild
from frobs_algos_sb3.model_files.save import read_sidecar
from frobs_algos_sb3.model_files.shared_layers import copy_shared_layers
from frobs_algos_sb3.model_files.spaces import SPACES, as_trained, check_spaces
from frobs_algos_sb3.model_files.text import Unreadable
from frobs_core.util.errors import CheckpointError, ConfigurationError, UntrustedFileError

_NEEDED = ("policy_class", "policy_kwargs", "use_sde")
"""Attributes that are required to build the policy."""

_GYM_MODULES = (
    "", ".spaces", ".spaces.box", ".spaces.dict", ".spaces.discrete", ".spaces.multi_binary", ".spaces.multi_discrete",
    ".spaces.space", ".spaces.tuple", ".utils", ".utils.seeding",
)  # fmt: skip
"""Modules of gym to which a model's pickles may refer."""

_FAILURES = (RuntimeError, ValueError, KeyError, TypeError, AttributeError, IndexError, AssertionError, MemoryError)
"""Exceptions that stable-baselines3 raises if the parts of a model do not match each other."""


def load_model(
    path: Path | str,
    env: gym.Env[Any, Any] | VecEnv | None = None,
    *,
    spaces: tuple[gym.Space[Any], gym.Space[Any]] | None = None,
    algorithm: str | None = None,
    trust: bool = False,
    device: str = "auto",
    defaults: Mapping[str, Any] | None = None,
    **overrides: Any,
) -> BaseAlgorithm:
    """Open a model file of stable-baselines3 or sb3-contrib without executing code in it.

    Args:
        path: Path of the file. The suffix ``.zip`` may be omitted.
        env: Environment for further training, or None for predictions only. Without an environment, attributes that are
            needed only for training (schedules, noise, …) may be unreadable.
        spaces: Observation and action space of the environment, for predictions only. Not required if ``env`` or
            ``trust`` is set, or if the JSON file written by FRobs is next to the model.
        algorithm: Name in :data:`frobs_algos_sb3.model_files.known.ALGORITHMS`, or None to identify the algorithm from
            the file.
        trust: Whether to open the file with stable-baselines3's own loader, which executes code in the file.
        device: Device of the networks.
        defaults: Values for attributes that cannot be read from the file.
        **overrides: Attributes that replace the values in the file, such as ``learning_rate=1e-3``.

    Returns:
        The model, an instance of the algorithm's class in stable-baselines3.

    Raises:
        CheckpointError: The file is missing or damaged, or it contains a model of another algorithm.
        ConfigurationError: The environment's spaces differ from the model's spaces, or an override is invalid.
        UntrustedFileError: A required attribute can only be read by executing code in the file.
    """
    archive = read_archive(path)
    name = algorithm or known.identify(archive.data)
    if name is None or name not in known.ALGORITHMS:
        raise CheckpointError(
            f"{archive.path} was saved by {name or 'an algorithm that cannot be identified'}; choose one of these "
            f"algorithms: {', '.join(known.ALGORITHMS)}."
        )
    _check_algorithm(archive, name)
    try:
        cls = known.algorithm_class(name)
    except Unreadable as problem:
        raise ConfigurationError(f"{archive.path}: {problem}.") from None
    venv = None if env is None else cls._wrap_env(env, verbose=0)
    if venv is not None:
        spaces = venv.observation_space, venv.action_space
    elif spaces is not None:
        spaces = as_trained(spaces[0]), spaces[1]
    if spaces is not None:
        check_spaces(archive, spaces)
    if trust:
        return _load_trusted(archive, cls, venv, device, overrides)
    archive = copy_shared_layers(archive)
    model = rebuild(archive, cls, overrides)
    model.replace(read_sidecar(archive))
    model.replace(dict(zip(SPACES, spaces or (), strict=False)))
    if not model.values.keys() >= {*SPACES}:
        raise UntrustedFileError(
            archive.path,
            "without an environment (env=…), the model's spaces can only be read by executing code in the file",
        )
    _fill_in(archive, model, defaults or {}, training=env is not None)
    return _build(archive, cls, venv, device, model.values, overrides)


def _load_trusted(
    archive: ModelArchive, cls: type[BaseAlgorithm], env: Any, device: str, overrides: Mapping[str, Any]
) -> BaseAlgorithm:
    """Open the file, including its pickles, with stable-baselines3's loader.

    Old gym's spaces are replaced by Gymnasium's spaces.
    """
    unshared = copy_shared_layers(archive)
    objects = {} if unshared is archive else {"policy_kwargs": policy_kwargs(unshared.data["policy_kwargs"], unshared)}
    with _gym_as_gymnasium():
        return cls.load(io.BytesIO(unshared.content), env=env, device=device, custom_objects=objects, **overrides)


@contextmanager
def _gym_as_gymnasium() -> Iterator[None]:
    """Make Gymnasium's spaces available to pickles under gym's names, unless ``gym`` is installed."""
    names = [f"gymnasium{part}" for part in _GYM_MODULES] if importlib.util.find_spec("gym") is None else []
    added = {name.replace("gymnasium", "gym", 1): importlib.import_module(name) for name in names}
    sys.modules.update(added)
    try:
        yield
    finally:
        for name in added:
            del sys.modules[name]


def _check_algorithm(archive: ModelArchive, name: str) -> None:
    """Raise an error if the file contains a model of another algorithm. DDPG and TD3 can open each other's files."""
    real = known.identify(archive.data)
    if real is not None and real != name and {real, name} != {"td3", "ddpg"}:
        raise CheckpointError(f"{archive.path} is a model of '{real}', not of '{name}'.")


def _fill_in(archive: ModelArchive, found: Rebuilt, defaults: Mapping[str, Any], training: bool) -> None:
    """Use defaults for unreadable attributes, and raise an error if a required attribute is missing."""
    if "target_entropy" in found.unreadable:  # only 'auto' values are pickled
        found.replace({"target_entropy": -float(np.prod(found.values["action_space"].shape))})
    found.replace({key: defaults[key] for key in found.unreadable if key in defaults})
    for key in _NEEDED:
        if key not in found.values and key not in found.unreadable:
            raise CheckpointError(f"{archive.path} is damaged: its file 'data' does not contain the attribute '{key}'.")
    missing = [key for key in found.unreadable if training or key in _NEEDED]
    for key in missing:
        if key not in archive.pickled:
            raise CheckpointError(
                f"{archive.path} is damaged: the value of the attribute '{key}' cannot be used: "
                f"{found.unreadable[key]}."
            )
    if missing:
        raise UntrustedFileError(archive.path, "; ".join(_reason(key, found.unreadable[key]) for key in missing))


def _reason(key: str, why: str) -> str:
    """Explain why an attribute cannot be read without ``trust``, and how to open the model instead."""
    way = "" if key in ("policy_class", "policy_kwargs") else f", or pass {key}=…"
    return (
        f"the attribute '{key}' is stored as a pickle, which can execute code when it is opened, and cannot be "
        f"restored from the text next to the pickle ({why}){way}"
    )


def _build(
    archive: ModelArchive,
    cls: type[BaseAlgorithm],
    env: VecEnv | None,
    device: str,
    values: dict[str, Any],
    overrides: Mapping[str, Any],
) -> BaseAlgorithm:
    """Build the model with stable-baselines3 from a copy of the file without pickles."""
    lacks_rate = env is None and "learning_rate" not in {*values, *overrides}
    if lacks_rate:
        values["learning_rate"] = 0.0  # the state of the optimizer contains the last rate
    if env is None and values.get("replay_buffer_class") is HerReplayBuffer:  # its constructor requires an environment
        values |= {"replay_buffer_class": None, "replay_buffer_kwargs": {}}
    values.setdefault("verbose", 0)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "This system does not have apparently enough memory")
            model = cls.load(clean_copy(archive, values), env, device, custom_objects=values, **overrides)
    except _FAILURES as error:
        raise CheckpointError(
            f"{archive.path} cannot be opened, because its parts do not match each other: {_first_line(error)}."
        ) from error
    if lacks_rate:
        model.lr_schedule = _Unreadable(archive.path)
    return model


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).strip().splitlines()[0].rstrip(".")


class _Unreadable:
    """Placeholder for an unreadable schedule, so that training cannot silently use another schedule."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __call__(self, progress_remaining: float) -> float:
        raise UntrustedFileError(
            self._path,
            "the learning rate is a function, which was not read from the file; pass learning_rate=… when you open the "
            "model",
        )

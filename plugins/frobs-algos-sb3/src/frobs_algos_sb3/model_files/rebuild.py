"""Rebuilds a model's attributes from the readable part of its file."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import torch as th
from stable_baselines3.common import buffers
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.her import HerReplayBuffer

from frobs_algos_sb3.model_files import known, text
from frobs_algos_sb3.model_files.archive import ModelArchive
from frobs_algos_sb3.model_files.spaces import SPACES
from frobs_algos_sb3.model_files.text import Unreadable

_ONLY_CODE = "the file contains the value only as code, which is not executed"
_FRESH = (
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
    "_last_lstm_states",
    "ep_info_buffer",
    "ep_success_buffer",
    "tensorboard_log",  # an untrusted file must not choose the log folder
    "start_time",
)
"""Attributes that an opened model initializes itself. Their values in the file are ignored."""

_BUFFERS = {
    **dict.fromkeys(("ReplayBuffer", "DictReplayBuffer", "NStepReplayBuffer", "RolloutBuffer", "DictRolloutBuffer",
                     "RecurrentRolloutBuffer", "RecurrentDictRolloutBuffer")),
    "HerReplayBuffer": HerReplayBuffer,
}  # fmt: skip
"""Buffer classes by name, or None if the model selects the class based on its spaces."""

_MAX_LAYERS = 64
_SIZES = ("features_dim", "cnn_output_dim", "lstm_hidden_size")
_COUNTS = ("n_critics", "n_quantiles", "n_lstm_layers")


@dataclass
class Rebuilt:
    """Attributes of a model that were read without executing code, and the reasons why the rest are unreadable."""

    values: dict[str, Any] = field(default_factory=dict)
    unreadable: dict[str, str] = field(default_factory=dict)

    def replace(self, values: Mapping[str, Any]) -> None:
        """Use other values for some attributes."""
        self.values.update(values)
        self.unreadable = {name: reason for name, reason in self.unreadable.items() if name not in values}


def rebuild(archive: ModelArchive, cls: type[BaseAlgorithm], given: Iterable[str]) -> Rebuilt:
    """Read all attributes of a model class from a file, except for its spaces and the attributes in ``given``."""
    data, result = archive.data, Rebuilt()
    names = set(_attributes(cls)) - {*_FRESH, *SPACES}
    for name in [name for name in data if name in names and name not in given]:
        try:
            result.values[name] = _read(name, archive)
        except Unreadable as problem:
            result.unreadable[name] = str(problem)
    if "policy_class" in result.unreadable:  # without the class, its keyword arguments are useless
        result.unreadable.pop("policy_kwargs", None)
        result.values["policy_kwargs"] = {}
    return result


def _attributes(cls: type[BaseAlgorithm]) -> list[str]:
    """Return the names of the attributes of a model class that can be read from a file."""
    bare = cls(policy=BasePolicy, env=None, _init_setup_model=False)  # type: ignore[call-arg]
    return [*vars(bare), "policy_class", "n_envs"]


def _read(name: str, archive: ModelArchive) -> Any:
    value = archive.data[name]
    if name == "policy_kwargs":
        return policy_kwargs(value, archive)
    if name in _READERS:
        return _READERS[name](value)
    if name in archive.pickled:
        raise Unreadable(_ONLY_CODE)
    return _scalar(value)


def _scalar(value: Any) -> bool | int | float | None:
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int | float) and math.isfinite(value) and abs(value) < 2**53:
        return value
    raise Unreadable("the value is not a number")


def _word_or_number(value: Any) -> str | float:
    if isinstance(value, str):
        first, _, rest = value.partition("_")
        if first == "auto" and (not rest or re.fullmatch(r"\d+(\.\d+)?", rest)):
            return value
        raise Unreadable("the value is neither a number nor 'auto'")
    return text.number(value)


def _plain_mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict) or ":type:" in value:
        raise Unreadable(_ONLY_CODE)
    return {str(key): item if isinstance(item, str) else _scalar(item) for key, item in value.items()}


def _buffer_class(value: Any) -> type[buffers.ReplayBuffer] | None:
    """Return a pickled buffer class, whose name is part of the name of its constructor."""
    if value is None:
        return None
    name = text.constructed_class(value)
    if name not in _BUFFERS:
        raise Unreadable("it is not a buffer class of stable-baselines3")
    return _BUFFERS[name]


_READERS: Mapping[str, Callable[[Any], Any]] = {
    "policy_class": known.policy_class,
    "replay_buffer_class": _buffer_class,
    "rollout_buffer_class": _buffer_class,
    "replay_buffer_kwargs": _plain_mapping,
    "rollout_buffer_kwargs": _plain_mapping,
    "n_envs": lambda value: text.integer(value, 1, 2**16),  # limited, because each environment needs memory
    "ent_coef": _word_or_number,
    "target_entropy": _word_or_number,
}
"""Functions that read certain attributes. All others are numbers."""


def policy_kwargs(value: Any, archive: ModelArchive) -> dict[str, Any]:
    """Return the policy's keyword arguments, or raise Unreadable for unknown keywords or sizes that match no tensor."""
    if not isinstance(value, dict):
        raise Unreadable("it is not a mapping")
    accepted = inspect.signature(known.policy_class(archive.data.get("policy_class")).__init__).parameters
    sizes = _sizes(archive.tensors["policy"])
    return {key: _keyword(key, item, accepted, sizes) for key, item in value.items() if key not in (":type:", "device")}


def _keyword(key: str, value: Any, accepted: Mapping[str, Any], sizes: set[int]) -> Any:
    if key not in accepted:
        raise Unreadable(f"the policy does not accept '{key}'")
    if key in ("activation_fn", "optimizer_class", "features_extractor_class"):
        return known.policy_argument_class(key, value)
    if key in ("net_arch", "critic_net_arch"):
        return _net_arch(value, sizes)
    if key in ("features_extractor_kwargs", "optimizer_kwargs", "lstm_kwargs"):
        if value is None:
            return None
        if not isinstance(value, dict):
            raise Unreadable(f"'{key}' is stored only as code")
        return {str(name): _inner(str(name), item, sizes) for name, item in value.items()}
    return _inner(key, value, sizes)


def _inner(key: str, value: Any, sizes: set[int]) -> Any:
    if isinstance(value, list) and len(value) <= 8:  # an optimizer's betas
        return tuple(text.number(item) for item in value)
    if key in _SIZES:
        return _size(value, sizes)
    if key in _COUNTS:
        return text.integer(value, 1, 1024)
    if isinstance(value, str):
        raise Unreadable(f"'{key}' is stored only as code")
    return _scalar(value)


def _net_arch(value: Any, sizes: set[int]) -> Any:
    if isinstance(value, list) and len(value) == 1 and isinstance(value[0], dict):  # stable-baselines3 < 1.8
        value = value[0]
    if isinstance(value, dict) and set(value) <= {"pi", "vf", "qf"}:
        return {key: _net_arch(widths, sizes) for key, widths in value.items()}
    if value is None:
        return None
    if not isinstance(value, list) or len(value) > _MAX_LAYERS:
        raise Unreadable("'net_arch' is not a list of layer widths")
    return [_size(width, sizes) for width in value]


def _size(value: Any, sizes: set[int]) -> int:
    size = text.integer(value, 1)
    if size not in sizes:
        raise Unreadable(f"no tensor in the file has a dimension of size {size}")
    return size


def _sizes(tensors: Any) -> set[int]:
    """Return all dimensions of the policy's tensors, which limit the networks that a file can request."""
    if not isinstance(tensors, Mapping) or not all(isinstance(item, th.Tensor) for item in tensors.values()):
        raise Unreadable("'policy.pth' contains no state dictionary")
    return {side for tensor in tensors.values() for side in tensor.shape}

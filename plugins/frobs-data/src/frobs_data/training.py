"""Arrays for learning algorithms, in the layout of an environment's observation and action."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.description import ObservationTerm
from frobs_core.kernel.env import RobotEnv
from frobs_core.kernel.mixed_vector_env import MixedVectorEnv
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.util.errors import ParameterValueError, check_keys
from frobs_core.util.memory import require_memory
from frobs_core.util.yaml import load_yaml
from frobs_data.budgets import BUDGET
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.recorded_features import action_names

_PER_FRAME = {
    **{"reward": "next.reward", "terminated": "next.terminated", "success": "next.success"},
    "intervention": "intervention",
}
_ROUNDING = 1e-3  # of the range of an action
_EXAMPLE = "observation: {%s: {feature: observation.state, columns: [0, 1, 2]}}"


class _Source:
    """Feature and columns that contain an observation term or the action. ``columns`` is None for all columns."""

    def __init__(self, owner: str, value: Any) -> None:
        value = {"feature": value} if isinstance(value, str) else value
        if not isinstance(value, Mapping) or "feature" not in value:
            raise ParameterValueError(owner, value, "a feature's name, or a mapping with 'feature' and 'columns'")
        check_keys(owner, value, ("feature", "columns"))
        self.feature, self.columns = value["feature"], value.get("columns")
        if not isinstance(self.columns, list | None) or not all(type(i) is int for i in self.columns or ()):
            raise ParameterValueError(f"{owner}.columns", self.columns, "a list of whole numbers, from 0")

    def read(self, dataset: Dataset, owner: str, size: int) -> np.ndarray[Any, Any]:
        """Return the values, (frames, size)."""
        feature = dataset.features.get(self.feature)
        if feature is None or not feature.is_numeric:
            known = ", ".join(name for name, found in dataset.features.items() if found.is_numeric)
            raise DataError(dataset.folder, f"{owner}: there is no column '{self.feature}'. Available: {known}.")
        columns = list(range(feature.size)) if self.columns is None else self.columns
        if len(columns) != size or not all(0 <= column < feature.size for column in columns):
            reason = f"{owner} has {size} elements, but the mapping takes {len(columns)}"
            raise DataError(dataset.folder, f"{reason} of the {feature.size} columns of '{self.feature}'.")
        values = dataset.columns([self.feature])[self.feature]
        chosen = values.reshape(len(values), -1)[:, columns]
        if not np.isfinite(chosen).all():
            frame = int(np.flatnonzero(~np.isfinite(chosen).all(axis=1))[0])
            raise DataError(dataset.folder, f"'{self.feature}' is not finite in frame {frame:,}; record it again.")
        return chosen


def training_arrays(
    folder: Path | str,
    env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any],
    mapping: Mapping[str, Any] | Path | str | None = None,
) -> dict[str, Any]:
    """Return a data set as arrays in the layout of an environment's observation and action.

    Observation terms are found by name: ``frobs record`` names each element ``<term>_<i>``, or ``<term>`` if the term
    has one element, and each picture ``observation.images.<term>``. For other data sets, a mapping says where they are::

        action: action
        observation:
          joint_positions: {feature: observation.state, columns: [0, 1, 2, 3, 4, 5]}
          front: observation.images.top
        any_rate: true   # accept another number of frames per second

    Args:
        folder: Folder of the data set.
        env: FRobs environment or vector environment.
        mapping: The mapping, or its YAML file. With a mapping, the data set may be of another robot.

    Returns:
        ``observation`` (frames, …) float32, or a dictionary for dictionary observations; ``action`` (frames, …) in the
        space's dtype; ``reward`` (frames,) float32, and ``terminated``, ``success``, ``intervention`` and
        ``episode_start`` (frames,) bool. Reward, termination and success are zero if the data set does not contain
        them, and ``intervention`` is True, because the data set demonstrates the task in all steps.

    Raises:
        DataError: The data set is damaged, lacks a term, contains numbers that are not finite, or does not fit the
            environment's action space, control rate or robot, or a wrapper changes the observations or actions.
        ConfigurationError: The mapping is invalid, or the observations do not fit into memory.
    """
    dataset, base = Dataset(folder), env.unwrapped
    if isinstance(base, MixedVectorEnv):  # all have the same robot, observation and action
        base = next(iter(base.parts.values()))
    if not isinstance(base, RobotEnv | RobotVectorEnv):
        raise DataError(folder, "only FRobs environments without wrappers for single environments can use it.")
    if _spaces(env) != _spaces(base):
        raise DataError(
            folder, "a wrapper of the environment changes the observations or the actions; omit the wrapper."
        )
    given = load_yaml(mapping) if isinstance(mapping, Path | str) else dict(mapping or {})
    check_keys("the mapping", given, ("action", "observation", "any_rate"))
    terms = given.get("observation") or {}
    if not isinstance(terms, Mapping):
        raise ParameterValueError("observation", terms, "a mapping from observation terms to features")
    check_keys("the observation", terms, base.observations.terms)
    _check_fit(dataset, base, mapping is not None, given.get("any_rate") is True)
    space = _spaces(base)[1]
    action = _read_action(dataset, given.get("action") or "action", space)
    episode_start = np.zeros(len(dataset), bool)
    episode_start[np.cumsum([0, *(episode.length for episode in dataset.episodes[:-1])])] = True
    found = {
        "observation": _observation(dataset, base.observations, terms),
        "action": action.astype(space.dtype).reshape(-1, *space.shape),
        "episode_start": episode_start,
    }
    for name, feature in _PER_FRAME.items():
        known = feature in dataset.features
        missing = np.full(len(dataset), name == "intervention")
        values = _Source(name, feature).read(dataset, name, 1) if known else missing
        found[name] = values.reshape(-1).astype(np.float32 if name == "reward" else np.bool_)
    return found


def _spaces(env: Any) -> list[Any]:
    """Return the observation space and the action space of a single environment."""
    return [
        getattr(env, f"single_{name}", None) or getattr(env, name) for name in ("observation_space", "action_space")
    ]


def _read_action(dataset: Dataset, source: Any, space: Any) -> np.ndarray[Any, Any]:
    """Return the actions, (frames, size)."""
    action = _Source("action", source).read(dataset, "action", int(np.prod(space.shape or 1)))
    if isinstance(space, gym.spaces.Box):
        low, high = space.low.ravel(), space.high.ravel()
        outside = (np.maximum(low - action, action - high) > _ROUNDING * (high - low)).any(axis=1)
        if outside.any():
            reason = (
                f"the action in frame {int(np.argmax(outside)):,} is outside the bounds {space.low} to {space.high}"
            )
            advice = "choose the controller of the recording, or write a data set with scaled actions"
            raise DataError(dataset.folder, f"{reason}; {advice}.")
    return action


def _check_fit(dataset: Dataset, env: Any, mapped: bool, any_rate: bool) -> None:
    if not dataset.episodes:
        raise DataError(dataset.folder, "the data set contains no episodes; record some first.")
    rate, robot = 1.0 / env.control_timestep, env.robot.robot.name
    if round(rate) != dataset.fps and not any_rate:
        advice = f"set control_timestep={1.0 / dataset.fps:.6g}, or write 'any_rate: true' in a mapping file"
        raise DataError(dataset.folder, f"it has {dataset.fps} frames per second, the environment {rate:g}; {advice}.")
    if not mapped and dataset.robot_type not in (None, robot):
        advice = f"choose robot={dataset.robot_type!r:.60}, or pass a mapping file"
        raise DataError(dataset.folder, f"it was recorded with another robot than '{robot}'; {advice}.")
    names = dataset.features["action"].names if "action" in dataset.features else ()
    if not mapped and names and names != (own := action_names(env.control)):
        reason = f"its actions are {', '.join(names)[:200]}, those of the environment {', '.join(own)}"
        raise DataError(dataset.folder, f"{reason}; choose the controller of the recording, or pass a mapping file.")


def _observation(dataset: Dataset, observations: Any, mapping: Mapping[str, Any]) -> Any:
    sources = {name: _find(dataset, name, term, mapping) for name, term in observations.terms.items()}
    missing = [name for name, source in sources.items() if source is None]
    if missing:
        example = _EXAMPLE % missing[0]
        reason = f"the data set has no features for the observation terms {', '.join(missing)}"
        raise DataError(dataset.folder, f"{reason}; pass a mapping file with lines such as '{example}'.")
    space = observations.space
    spaces: dict[str, Any] = space.spaces if isinstance(space, gym.spaces.Dict) else {"observation": space}
    size = sum(int(np.prod(part.shape)) * part.dtype.itemsize for part in spaces.values())
    if size * len(dataset) > (limit := BUDGET["bytes of decoded pictures in memory"]):
        raise DataError(dataset.folder, f"the observations need more than {limit:,} bytes; split the data set.")
    require_memory(str(dataset.folder), size, len(dataset), "steps", "use a data set of at most {count} steps")
    arrays = {key: np.empty((len(dataset), *part.shape), part.dtype) for key, part in spaces.items()}
    for name, source in sources.items():
        assert source is not None
        key, columns = observations.columns[name]
        if observations.terms[name].is_vector:
            arrays[key][:, columns] = source.read(dataset, name, columns.stop - columns.start)
        else:
            _read_pictures(dataset, name, source.feature, arrays[key])
    return arrays if isinstance(space, gym.spaces.Dict) else arrays["observation"]


def _find(dataset: Dataset, name: str, term: ObservationTerm, mapping: Mapping[str, Any]) -> _Source | None:
    if name in mapping:
        return _Source(f"observation.{name}", mapping[name])
    if not term.is_vector:
        picture = f"observation.images.{name}"
        return _Source(name, picture) if picture in dataset.features else None
    size = len(term.low)
    elements = [name] if size == 1 else [f"{name}_{i}" for i in range(size)]
    for feature, found in dataset.features.items():
        if found.is_numeric and set(elements) <= set(found.names):
            return _Source(name, {"feature": feature, "columns": [found.names.index(item) for item in elements]})
    return None


def _read_pictures(dataset: Dataset, name: str, key: Any, out: np.ndarray[Any, Any]) -> None:
    feature = dataset.features.get(key)
    if feature is None or not feature.is_video or feature.shape != out.shape[1:]:
        shape = "not a camera" if feature is None or not feature.is_video else str(feature.shape)
        reason = f"the observation term '{name}' needs pictures of shape {out.shape[1:]}, but '{key}' is {shape}"
        raise DataError(dataset.folder, f"{reason}.")
    pictures = chain.from_iterable(dataset.iter_pictures(episode.index, key) for episode in dataset.episodes)
    for row, picture in zip(out, pictures, strict=True):
        row[:] = picture

"""Validation of the arguments of ``step`` and ``reset``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Action, Floats, Mask
from frobs_core.util.errors import InvalidActionError, ParameterValueError, ResetOptionError, check_keys
from frobs_core.util.validation import whole_number


def as_numbers(action: Any, space: gym.Space[Any]) -> Floats:
    """Return an action as an array of the same shape.

    Raises:
        InvalidActionError: The action does not consist of numbers, or its rows have different lengths.
    """
    try:
        return np.asarray(action, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise invalid_action(action, space) from None


def invalid_action(action: Any, space: gym.Space[Any]) -> InvalidActionError:
    """Return an error that explains why an action is not in the action space."""
    try:
        given = np.asarray(action)
    except ValueError:
        text = f"the rows of the action have different lengths; the action space has the shape {space.shape}."
        return InvalidActionError(text)
    if given.shape != space.shape:
        text = f"the action has the shape {given.shape}, but the action space has the shape {space.shape}."
    elif given.dtype.kind not in "biuf":
        text = f"the action {action!r:.80} does not consist of numbers; the action space is {space}."
    elif where := np.argwhere(~np.isfinite(given)).tolist():
        first = given[tuple(where[0])]
        text = f"the action contains non-finite values at the indices {where[:3]}; the first is {first}."
    else:
        text = f"the action {action!r} is not in {space}."
    return InvalidActionError(text)


def check_actions(actions: Any, space: gym.Space[Any]) -> Action:
    """Return the actions of all environments, (num_envs, …), as an array.

    Raises:
        InvalidActionError: The actions have the wrong shape, are not finite, or are not in a discrete space.
    """
    array = as_numbers(actions, space)
    # A dot product would be faster than isfinite, but its threads would compete with the engine's threads.
    if array.shape == space.shape and np.isfinite(array).all():
        if isinstance(space, gym.spaces.Box):
            return array
        numbers = array.astype(np.int64)
        if (numbers == array).all() and space.contains(numbers):
            return numbers
    raise invalid_action(actions, space)


def check_seeds(seeds: Any, num_envs: int) -> Sequence[int | None]:
    """Return a list with the seed of each of ``num_envs`` environments.

    Raises:
        ParameterValueError: ``seeds`` is not a list with one whole number or None for each environment.
    """
    if isinstance(seeds, str) or not isinstance(seeds, Sequence | np.ndarray):
        raise ParameterValueError("seed", seeds, "a whole number, a list with one number per environment, or None")
    for number in seeds:
        if number is not None:
            whole_number("seed", number)
    if len(seeds) != num_envs:
        raise ParameterValueError("number of seeds", len(seeds), f"{num_envs}, one for each environment")
    return list(seeds)


def check_reset_mask(given: Any, num_envs: int) -> Mask:
    """Return the option ``"reset_mask"`` as an array, (num_envs,) bool.

    Raises:
        ResetOptionError: It is not a mask of this shape, or selects no environment.
    """
    try:
        mask = np.asarray(given)
    except ValueError:  # rows of different lengths
        mask = np.empty(0)
    if mask.shape != (num_envs,) or mask.dtype != np.bool_ or not mask.any():
        raise ResetOptionError(
            "reset_mask", f"is {given}; it must be a boolean array of shape ({num_envs},) with at least one True."
        )
    return mask


def option_mapping(options: Any) -> dict[str, Any]:
    """Return reset options as a new dictionary.

    Raises:
        ConfigurationError: The options are not a mapping.
    """
    if not isinstance(options, Mapping | None):
        raise ParameterValueError("options", options, "a mapping by name, or None")
    return dict(options or {})


def batch_options(options: Mapping[str, Any] | None, known: Sequence[str], num_envs: int) -> dict[str, Floats]:
    """Validate reset options and repeat them for every environment.

    Args:
        options: Option values by name: either one value for all environments, or one row per environment.
        known: Options that the task accepts.
        num_envs: ≥ 1.

    Returns:
        Option values by name, (num_envs, …) float64 each.

    Raises:
        UnknownParameterError: The task does not accept one of the options.
        ConfigurationError: A value is not finite, or has the wrong number of rows.
    """
    batched = {}
    given = option_mapping(options)
    check_keys("reset(options=…)", given, known)
    for name, value in given.items():
        try:
            array = np.asarray(value, np.float64)
        except (TypeError, ValueError, OverflowError):
            raise ResetOptionError(name, f"is {value!r:.80}; it must consist of numbers.") from None
        if not np.isfinite(array).all():
            raise ResetOptionError(name, f"contains a number that is not finite: {value}.")
        if array.ndim < 2:
            array = np.broadcast_to(array, (num_envs, *array.shape))
        elif len(array) != num_envs:
            raise ResetOptionError(name, f"has {len(array)} rows for {num_envs} environments.")
        batched[name] = array
    return batched

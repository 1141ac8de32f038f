"""Copies and pickles of environments, which consist of the arguments of their constructor."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.errors import EnvironmentCopyError


class CopiedByArguments:
    """Environment whose copies are new environments with the same arguments.

    A copy has not been reset, and its lists of callbacks, such as ``after_reset``, are empty. Both ``pickle`` and
    ``copy`` create such copies, also of a closed environment and through Gymnasium's wrappers. ``copy.deepcopy`` passes
    objects among the arguments, such as records, to the new environment without copying them.
    """

    config: EnvConfig
    spec: Any
    _arguments: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *args: Any, **keywords: Any) -> Self:
        """Keep the arguments, also those of a subclass's constructor."""
        env = super().__new__(cls)
        env._arguments = _containers_copied(args), _containers_copied(keywords)  # the caller may change them later
        return env

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the constructor's arguments for pickling.

        Raises:
            EnvironmentCopyError: The simulator is paced.
        """
        simulator = find_record(SimulatorRecord, self.config.simulator)
        if simulator.is_paced:
            raise EnvironmentCopyError(f"simulator '{simulator.name}' is paced, so a copy would command the same robot")
        return _build, (type(self), *self._arguments), {"spec": self.spec}

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return a new environment to which objects among the arguments are passed without copying them."""
        _, arguments, state = self.__reduce__()
        env: Self = _build(*arguments)
        env.__dict__.update(state)
        return env


def _build(cls: type[Any], args: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
    return cls(*args, **keywords)


def _containers_copied(value: Any) -> Any:
    """Return a value whose dictionaries, lists, tuples and arrays are copies."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, Mapping):
        items = {key: _containers_copied(item) for key, item in value.items()}
        if type(value) is dict or not isinstance(value, dict):
            return items
        copied = copy.copy(value)  # keeps the attributes of subclasses, such as ControllerDefaults
        copied.update(items)
        return copied
    if type(value) in (list, tuple):
        return type(value)(_containers_copied(item) for item in value)
    return value

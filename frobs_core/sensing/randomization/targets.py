"""Targets of physical parameters, and patterns that select targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from frobs_core.contracts import Simulation
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError, UnknownNameError

ROBOT = "robot"
"""Name of the environment's robot. Patterns may omit this name."""


@dataclass(frozen=True, eq=False)
class Unit:
    """A group of values that are read and written in one call.

    Attributes:
        target: Name of the target in the simulation.
        names: Name of each value's owner.
        nominal: Nominal values of the model, (num_envs, len(names)).
    """

    target: str
    names: tuple[str, ...]
    nominal: Floats


def find_units(simulation: Simulation, parameter: str) -> list[Unit]:
    """Return all :class:`Unit` objects of a physical parameter in a simulation.

    For ``mass``, links without a mass are omitted. For ``friction``, bodies that do not collide are omitted.
    """
    match parameter:
        case "gravity":
            return [_read(simulation, parameter, "", ("x", "y", "z"))]
        case "mass" | "friction":
            links = [f"{name}/{link.name}" for name, robot in simulation.robots.items() for link in robot.model.links]
            units = []
            for target in [*links, *simulation.bodies, *(["floor"] if parameter == "friction" else [])]:
                try:
                    unit = _read(simulation, parameter, target, (target,))
                except (UnknownNameError, ConfigurationError):  # the link lacks the parameter, or is merged
                    continue
                if parameter == "friction" or (unit.nominal > 0).all():
                    units.append(unit)
            return units
        case "stiffness" | "damping" | "joint_damping":
            return [
                _read(simulation, parameter, name, tuple(f"{name}/{joint}" for joint in robot.joint_names))
                for name, robot in simulation.robots.items()
            ]
        case _:  # size, looks, or a parameter of a plugin
            targets = simulation.parameter_targets(parameter)
            return [_read(simulation, parameter, target) for target in targets]


def matches(patterns: Sequence[str], names: Sequence[str], what: str) -> list[int]:
    """Return the indices of the names that match the patterns, in ascending order.

    Args:
        patterns: Patterns with ``*`` and ``?``, in which the prefix ``"robot/"`` may be omitted.
        names: Existing names.
        what: Description of the names for the error message, such as ``"target of randomize.mass"``.

    Raises:
        UnknownNameError: A pattern does not match any name.
    """
    found: set[int] = set()
    for pattern in patterns:
        hits = {
            i
            for i, name in enumerate(names)
            if fnmatchcase(name, pattern) or fnmatchcase(name.removeprefix(f"{ROBOT}/"), pattern)
        }
        if not hits:
            raise UnknownNameError(what, pattern, list(dict.fromkeys(names)))
        found |= hits
    return sorted(found)


def _read(simulation: Simulation, parameter: str, target: str, names: tuple[str, ...] = ()) -> Unit:
    """Return a unit. Without names, each of its values has the name of the target."""
    values = np.array(simulation.parameter(parameter, target), np.float64).reshape(simulation.num_envs, -1)
    return Unit(target, names or (target or parameter,) * values.shape[1], values)

"""Settings for Bullet's physics engine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from frobs_core.util.validation import choice, finite, non_negative, whole_number

_CONES = {"pyramidal": 0, "elliptic": 1}

_OPTIONS: Mapping[str, tuple[str, Callable[[str, Any], Any]]] = {
    "cone": ("enableConeFriction", lambda name, value: _CONES[choice(name, value, _CONES)]),
    "iterations": ("numSolverIterations", partial(whole_number, lowest=1)),
    "tolerance": ("solverResidualThreshold", non_negative),
    "erp": ("erp", finite),
    "contact_erp": ("contactERP", finite),
    "friction_erp": ("frictionERP", finite),
    "cfm": ("globalCFM", non_negative),
}


class Engine(NamedTuple):
    """Settings for the physics engine.

    Attributes:
        timestep: Duration of a physics step [s].
        parameters: Additional keyword arguments for ``pybullet.setPhysicsEngineParameter``.
    """

    timestep: float
    parameters: Mapping[str, int | float]


def read_options(given: Mapping[str, Any]) -> dict[str, int | float]:
    """Validate options, and return them as keyword arguments for ``pybullet.setPhysicsEngineParameter``.

    Args:
        given: Arguments of the simulation, by name. Arguments that are not engine options are ignored. If an option is
            None, Bullet's default applies.
    """
    return {keyword: check(name, given[name]) for name, (keyword, check) in _OPTIONS.items() if given[name] is not None}

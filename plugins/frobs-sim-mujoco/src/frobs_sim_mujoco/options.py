"""User-settable options of MuJoCo's solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import mujoco

from frobs_core.util.validation import choice, non_negative, number_list, positive, whole_number

_SOLVERS = {"pgs": mujoco.mjtSolver.mjSOL_PGS, "cg": mujoco.mjtSolver.mjSOL_CG, "newton": mujoco.mjtSolver.mjSOL_NEWTON}
_CONES = {"pyramidal": mujoco.mjtCone.mjCONE_PYRAMIDAL, "elliptic": mujoco.mjtCone.mjCONE_ELLIPTIC}

_INTEGRATORS = {
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}

_CHECKS: Mapping[str, Callable[[str, Any], Any]] = {
    "solver": lambda name, value: int(_SOLVERS[choice(name, value, _SOLVERS)]),
    "cone": lambda name, value: int(_CONES[choice(name, value, _CONES)]),
    "integrator": lambda name, value: int(_INTEGRATORS[choice(name, value, _INTEGRATORS)]),
    "impratio": positive,
    "density": non_negative,
    "viscosity": non_negative,
    "wind": partial(number_list, count=3),
    "iterations": partial(whole_number, lowest=1),
    "tolerance": non_negative,
    "ls_iterations": partial(whole_number, lowest=1),
    "ls_tolerance": non_negative,
    "noslip_iterations": whole_number,
    "noslip_tolerance": non_negative,
    "ccd_iterations": partial(whole_number, lowest=1),
    "ccd_tolerance": non_negative,
}

Options = Mapping[str, int | float | Sequence[float]]
"""Values of ``mjOption`` fields, by field name."""


def read_options(given: Mapping[str, Any]) -> Options:
    """Validate options and convert them to MuJoCo's numeric values.

    Args:
        given: Arguments of the simulation, by name. Arguments that are not ``mjOption`` fields are ignored. If an
            argument is None, MuJoCo's default applies.

    Raises:
        ConfigurationError: A value is out of range.
    """
    return {name: check(name, given[name]) for name, check in _CHECKS.items() if given[name] is not None}

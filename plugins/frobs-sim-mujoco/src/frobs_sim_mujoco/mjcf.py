"""Exports the model of a simulation as MJCF text for other programs that use MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SimulationError


class Mjcf(NamedTuple):
    """A model as MJCF text, which rounds numbers to six digits, and the exact values of the numbers that it rounds.

    To get the same model as the simulation, compile the text, and then set each array of the compiled model.

    Attributes:
        xml: The MJCF text, which refers to no other files.
        arrays: Exact values of the float64 arrays of the compiled model that the text changes, by their names in
            ``mjModel``.
    """

    xml: str
    arrays: Mapping[str, Floats]


def write_mjcf(model: mujoco.MjModel, spec: mujoco.MjSpec) -> Mjcf:
    """Return a compiled model as MJCF text with exact arrays.

    Args:
        model: The compiled model.
        spec: The specification that it was compiled from.

    Raises:
        SimulationError: The text would refer to other files.
    """
    xml = spec.to_xml()
    files = [element.get("file", "") for element in ElementTree.fromstring(xml).iter() if element.get("file")]
    if files:
        raise SimulationError(
            f"the model cannot be exported as a single MJCF text, because it refers to {', '.join(files[:3])}; use a "
            "robot without meshes and textures, or one whose model file is a URDF."
        )
    rounded = mujoco.MjModel.from_xml_string(xml)
    arrays = {}
    for name in dir(model):
        exact = getattr(model, name) if not name.startswith("_") else None
        if isinstance(exact, np.ndarray) and exact.dtype == np.float64:
            text = getattr(rounded, name)
            if exact.shape != text.shape:
                raise SimulationError(f"the array '{name}' of the model cannot be exported, because its size changes.")
            if not np.array_equal(exact, text):
                arrays[name] = exact.copy()
    return Mjcf(xml, arrays)

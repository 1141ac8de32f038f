"""Settings of ODE, Gazebo's physics engine, in the world file that a server loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from frobs_core.util.validation import choice, non_negative, whole_number

_WORLD = Path(__file__).parent / "world_plugin" / "frobs.world"
_CONES = {"pyramidal": "pyramid_model", "elliptic": "cone_model"}

_OPTIONS: Mapping[str, tuple[str, Callable[[str, Any], Any]]] = {
    "solver": ("solver/type", partial(choice, choices=("world", "quick"))),
    "iterations": ("solver/iters", partial(whole_number, lowest=1)),
    "cone": ("solver/friction_model", lambda name, value: _CONES[choice(name, value, _CONES)]),
    "erp": ("constraints/erp", non_negative),
    "cfm": ("constraints/cfm", non_negative),
}


def world_text(**given: Any) -> bytes:
    """Return the text of the world file with changed settings.

    Args:
        given: Settings, by name. If a setting is None, the value in the file is not changed.

    Raises:
        ConfigurationError: A value is out of range.
    """
    text = _WORLD.read_bytes()
    values = {_OPTIONS[name][0]: _OPTIONS[name][1](name, value) for name, value in given.items() if value is not None}
    if not values:
        return text
    root = ElementTree.fromstring(text)
    engine = root.find("world/physics/ode")
    assert engine is not None
    for path, value in values.items():
        section, _, name = path.partition("/")
        parent = engine.find(section)
        assert parent is not None
        element = parent.find(name)
        (ElementTree.SubElement(parent, name) if element is None else element).text = str(value)
    return ElementTree.tostring(root)

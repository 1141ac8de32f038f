"""Finds the Python classes of message and service types by name."""

from importlib import import_module
from typing import Any


def find_type(name: str, kind: str = "msg") -> Any:
    """Return the class of a type, such as ``"geometry_msgs/Pose"``.

    Args:
        name: Name of the type, including its package.
        kind: ``"msg"`` for a message, or ``"srv"`` for a service.
    """
    package, _, short = name.partition("/")
    return getattr(import_module(f"{package}.{kind}"), short)

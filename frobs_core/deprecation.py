"""Letting something go without breaking who uses it: one warning that names the replacement."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class FrobsDeprecationWarning(DeprecationWarning):
    """Something of FRobs is used that will go; the message names what to use instead."""


def warn_deprecated(what: str, *, instead: str, since: str, removed_in: str, stacklevel: int = 2) -> None:
    """Warn that something will go.

    Args:
        what: What is used: ``"RobotHandle.joint_torques"``.
        instead: What to use: ``"RobotHandle.joint_efforts"``.
        since: The version of the core in which this was first said.
        removed_in: The version in which it goes; its major version is a later one (its minor version, before 1.0).
        stacklevel: 2: the caller of the function that calls this is the one to change.
    """
    text = f"{what} is deprecated since frobs-core {since} and goes in {removed_in}; use {instead}."
    warnings.warn(text, FrobsDeprecationWarning, stacklevel=stacklevel + 1)


def deprecated(*, instead: str, since: str, removed_in: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Mark a function or method that will go; the arguments are those of :func:`warn_deprecated`.

    Example::

        @deprecated(instead="load_model", since="0.2", removed_in="0.3")
        def read_model(path): ...
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def warning(*args: P.args, **kwargs: P.kwargs) -> R:
            what = f"{function.__module__}.{function.__qualname__}"
            warn_deprecated(what, instead=instead, since=since, removed_in=removed_in)
            return function(*args, **kwargs)

        return warning

    return decorate

"""Deprecation warnings that name the replacement."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class FrobsDeprecationWarning(DeprecationWarning):
    """Warning about the use of a deprecated part of FRobs. The message names the replacement."""


def warn_deprecated(what: str, *, instead: str, since: str, removed_in: str, stacklevel: int = 2) -> None:
    """Warn that a deprecated part of FRobs is used.

    Args:
        what: Deprecated part, such as ``"RobotHandle.joint_torques"``.
        instead: Replacement for the deprecated part, such as ``"RobotHandle.joint_efforts"``.
        since: Version of the core that first announced the deprecation.
        removed_in: Version that removes the part. It must be a later major version than ``since`` (before 1.0, a later
            minor version).
        stacklevel: Stack level of the code that uses the deprecated part. Level 2 is the caller of the function that
            calls ``warn_deprecated``.
    """
    text = f"{what} has been deprecated since frobs-core {since} and will be removed in {removed_in}; use {instead}."
    warnings.warn(text, FrobsDeprecationWarning, stacklevel=stacklevel + 1)


def deprecated(*, instead: str, since: str, removed_in: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Mark a function or method as deprecated. For the arguments, see :func:`warn_deprecated`.

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

"""Logs the errors of functions that return a value such as False instead of raising an exception."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

from frobs_core.util.errors import FrobsError
from frobs_rl_compat.ros.arguments import describe_arguments
from frobs_ros.errors import RosNotFoundError
from frobs_ros.ros import LOG

P = ParamSpec("P")
R = TypeVar("R")

refused: dict[str, FrobsError] = {}
"""Error of each ``vital`` function whose last call failed, by function name. See :func:`answers`."""

_constructing: ContextVar[bool] = ContextVar("constructing", default=False)


@contextlib.contextmanager
def constructing() -> Iterator[None]:
    """Create a context in which functions marked as ``vital`` raise errors instead of logging them."""
    token = _constructing.set(True)
    try:
        yield
    finally:
        _constructing.reset(token)


def answers(refusal: Any, *, pair: bool = False, vital: bool = False) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function so that it logs FRobs errors and returns ``refusal`` instead of raising them.

    RosNotFoundError is still raised. :func:`or_raise` returns the original function. The docstring's ``Args`` section is
    added from ``arguments.yaml``.

    Args:
        refusal: Return value after an error.
        pair: Whether to return ``(refusal, error message)`` after an error.
        vital: Whether an environment's constructor fails if this function fails.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def answering(*args: P.args, **kwargs: P.kwargs) -> R:
            refused.pop(function.__name__, None)
            try:
                return function(*args, **kwargs)
            except RosNotFoundError:
                raise
            except FrobsError as error:
                if vital:
                    refused[function.__name__] = error
                    if _constructing.get():
                        raise
                LOG.error("%s: %s", function.__name__, error)
                return (refusal, str(error)) if pair else refusal  # type: ignore[return-value]

        answering.__doc__ = describe_arguments(function)
        return answering

    return decorate


def or_raise(function: Callable[P, R]) -> Callable[P, R]:
    """Return the undecorated function, which raises errors instead of logging them."""
    return getattr(function, "__wrapped__", function)

"""What functions that answer with True and False say about a False."""

from __future__ import annotations

import contextlib
import functools
import logging
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

from frobs_core.errors import FrobsError
from frobs_ros.arguments import describe_arguments
from frobs_ros.errors import RosNotFoundError

P = ParamSpec("P")
R = TypeVar("R")

LOG = logging.getLogger("rosout.frobs_ros")
"""Below rospy's own logger: after ``rospy.init_node`` what is said here is on the screen, in ROS's log and on /rosout."""


refused: dict[str, FrobsError] = {}
"""The error of each function's last call, of functions marked with ``answers(…, vital=True)``, if it failed."""

_constructing: ContextVar[bool] = ContextVar("constructing", default=False)


@contextlib.contextmanager
def constructing() -> Iterator[None]:
    """Let functions that an environment cannot do without raise inside, as none may continue in an empty world."""
    token = _constructing.set(True)
    try:
        yield
    finally:
        _constructing.reset(token)


def answers(refusal: Any, *, pair: bool = False, vital: bool = False) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function return ``refusal`` where it would raise an error of FRobs, and log the error.

    That ROS is not installed at all is raised still. :func:`or_raise` calls the function as it was. Arguments that the
    docstring does not describe are added to it from :mod:`frobs_ros.arguments`.

    Args:
        refusal: What to return.
        pair: Return ``(refusal, the error's text)``.
        vital: An environment's constructor fails if this function does.
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
    """Return a function of this package as it is without :func:`answers`: it raises what it would log."""
    return getattr(function, "__wrapped__", function)

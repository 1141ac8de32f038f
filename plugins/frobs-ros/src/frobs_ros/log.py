"""Logging for functions that return True or False: why they return False."""

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
"""Child of rospy's logger: after ``rospy.init_node``, messages appear on the screen, in ROS's log and on /rosout."""


refused: dict[str, FrobsError] = {}
"""The errors of functions marked with ``answers(…, vital=True)``, if their last call failed."""

_constructing: ContextVar[bool] = ContextVar("constructing", default=False)


@contextlib.contextmanager
def constructing() -> Iterator[None]:
    """Make functions that an environment requires raise their errors inside this context."""
    token = _constructing.set(True)
    try:
        yield
    finally:
        _constructing.reset(token)


def answers(refusal: Any, *, pair: bool = False, vital: bool = False) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a function return ``refusal`` and log the error when it would raise an error of FRobs.

    A missing ROS installation is still raised. :func:`or_raise` calls the original function. Arguments that the
    docstring does not describe are added to it from :mod:`frobs_ros.arguments`.

    Args:
        refusal: Return value after an error.
        pair: Return ``(refusal, text of the error)``.
        vital: An environment's constructor fails if this function fails.
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
    """Return the original function of this package, which raises errors instead of logging them."""
    return getattr(function, "__wrapped__", function)

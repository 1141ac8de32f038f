"""Describes the arguments of FRobs_RL's functions, and shares arguments that several functions have in common."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Any

from frobs_core.util.yaml import load_yaml

_ARGUMENTS = load_yaml(Path(__file__).with_name("arguments.yaml"))
"""Meaning of each argument in all functions, under ``common``, and in single functions."""


def describe_arguments(function: Callable[..., Any]) -> str:
    """Return the docstring of a function or class, with an ``Args`` section from ``arguments.yaml`` added."""
    text = function.__doc__ or ""
    names = inspect.signature(function).parameters
    if not names:
        return text
    meanings = {**_ARGUMENTS["common"], **_ARGUMENTS.get(function.__name__, {})}
    rows = "".join(f"        {name}: {meanings[name]}\n" for name in names)
    head, *sections = re.split(r"\n(?=\n    (?:Attributes|Returns|Raises):)", text.rstrip())
    return "".join([f"{head}\n\n    Args:\n{rows}", *(f"{section}\n" for section in sections), "    "])


def with_parameters(function: Callable[..., Any], added: Iterable[inspect.Parameter]) -> Callable[..., Any]:
    """Return a function in whose signature the given parameters replace the ``**`` parameter."""
    own = inspect.signature(function)
    named = [parameter for parameter in own.parameters.values() if parameter.kind is not parameter.VAR_KEYWORD]
    signature = own.replace(parameters=[*named, *added])

    @wraps(function)
    def extended(*args: Any, **kwargs: Any) -> Any:
        return function(**signature.bind(*args, **kwargs).arguments)

    extended.__signature__ = signature  # type: ignore[attr-defined]
    return extended

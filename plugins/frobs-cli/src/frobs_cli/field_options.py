"""Turns the fields of a dataclass into options of a command, so that each field is documented once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import Field, field, fields, is_dataclass
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer

from frobs_cli.parameters import descriptions

_METAVARS: dict[Any, str] = {int: "N", float: "X", str: "NAME", Path: "FILE"}


def option(default: Any, **settings: Any) -> Any:
    """Return a field of a dataclass that is also an option of a command.

    The help of the option is the description of the field in the docstring of the dataclass.

    Args:
        default: Default value.
        settings: Keyword arguments of ``typer.Option``, and ``name`` if the name of the option differs from the name of
            the field.
    """
    return field(default=default, metadata={"option": settings})


def with_options(function: Callable[..., None]) -> Callable[..., None]:
    """Return the command ``function`` with each parameter that is a dataclass replaced by one option for each field.

    The options are the fields made by :func:`option`, and those that are annotated with ``typer.Option``, like a
    parameter of a command. Other fields keep their defaults.
    """
    signature = inspect.signature(function, eval_str=True)
    hints = {name: each.annotation for name, each in signature.parameters.items()}
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    if not groups:
        return function
    options = {name: list(_options(cls)) for name, cls in groups.items()}
    parameters = [option for each in signature.parameters.values() for option in options.get(each.name, [each])]

    def command(**values: Any) -> None:
        for name, cls in groups.items():
            chosen = {option.name: values.pop(option.name) for option in options[name]}
            values[name] = cls(**{key: value for key, value in chosen.items() if value is not None})
        function(**values)

    command.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in parameters]
    )
    return command


def _options(cls: Any) -> Iterator[inspect.Parameter]:
    hints, texts = get_type_hints(cls, include_extras=True), descriptions(cls)
    for each in fields(cls):
        annotation = hints[each.name]
        if "option" in each.metadata:
            annotation = _annotation(annotation, each, texts[each.name])
        if get_origin(annotation) is Annotated:
            default = None if each.default == () else each.default
            yield inspect.Parameter(each.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _annotation(hint: Any, of: Field[Any], text: str) -> Any:
    """Return the annotation of an option. Typer supports one type, optionally with None, and only lists as sequences."""
    settings = dict(of.metadata["option"])
    name = settings.pop("name", of.name.replace("_", "-"))
    kinds = [hint] if get_origin(hint) in (Sequence, Literal, tuple) else get_args(hint) or [hint]
    kind = Path if Path in kinds else next(kind for kind in kinds if kind is not NoneType)
    if get_origin(kind) is Sequence:
        kind = list[get_args(kind)[0]]  # type: ignore[misc]
    settings.setdefault("metavar", _METAVARS.get(kind))
    optional = of.default in (None, ())
    return Annotated[kind | None if optional else kind, typer.Option(f"--{name}", help=text, **settings)]

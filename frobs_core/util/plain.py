"""Conversion of values to JSON types."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np


def plain(value: Any, *, for_yaml: bool = False) -> Any:
    """Convert a value to JSON types: dictionaries, lists, strings, numbers, booleans and None.

    Args:
        value: Value to convert, which may contain arrays, dataclasses, enumerations and paths at any depth.
        for_yaml: Whether to keep non-finite numbers and objects of other types. A YAML dumper can then write the
            numbers and reject the objects. If False, non-finite numbers become None, and other objects become strings.
    """
    if isinstance(value, Enum):
        return str(value)
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist(), for_yaml=for_yaml)
    if isinstance(value, float):
        return value if for_yaml or math.isfinite(value) else None
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name), for_yaml=for_yaml) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item, for_yaml=for_yaml) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item, for_yaml=for_yaml) for item in value]
    return value if for_yaml else str(value)


def to_json(value: Any, *, indent: int | None = None, sort_keys: bool = False, ascii: bool = True) -> str:
    """Return a value as JSON. Everything that FRobs writes as JSON is converted by this function.

    Args:
        value: Value to convert, see :func:`plain`. Non-finite numbers become null, because JSON cannot represent them.
            An undefined result, such as the success rate of no episodes, is therefore null.
        indent: Number of spaces per level, or None to write a single line.
        sort_keys: Whether to sort the keys of dictionaries.
        ascii: Whether to escape all other characters, so that the text can be written in every encoding.
    """
    return json.dumps(plain(value), indent=indent, sort_keys=sort_keys, ensure_ascii=ascii, allow_nan=False)


_SPELLINGS = {math.inf: ".inf", -math.inf: "-.inf"}
_NUMBERS = {".inf": math.inf, "-.inf": -math.inf, ".nan": math.nan}


def spell_numbers(value: Any) -> Any:
    """Replace non-finite numbers by their spelling in YAML, such as ``".inf"``, so that JSON can represent settings.

    Args:
        value: Dictionaries, lists and numbers, such as the bounds of a space.
    """
    if isinstance(value, float) and not math.isfinite(value):
        return _SPELLINGS.get(value, ".nan")
    if isinstance(value, Mapping):
        return {key: spell_numbers(item) for key, item in value.items()}
    return [spell_numbers(item) for item in value] if isinstance(value, list | tuple) else value


def read_numbers(value: Any) -> Any:
    """Convert the output of :func:`spell_numbers` back."""
    if isinstance(value, str):
        return _NUMBERS.get(value, value)
    if isinstance(value, dict):
        return {key: read_numbers(item) for key, item in value.items()}
    return [read_numbers(item) for item in value] if isinstance(value, list) else value


def is_plain(value: object) -> bool:
    """Return whether a value consists only of JSON types, so that it can be compared, copied, pickled and written."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and is_plain(item) for key, item in value.items())
    if isinstance(value, list | tuple):
        return all(is_plain(item) for item in value)
    return value is None or type(value) in (bool, int, float, str)

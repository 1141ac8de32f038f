"""Strict parsers for the numbers and class names in a model file, which is untrusted."""

from __future__ import annotations

import math
import re
from typing import Any


class Unreadable(Exception):  # noqa: N818  # internal signal: the caller adds the field's name
    """Raised if a value cannot be determined from the readable part of the file."""


def number(value: Any) -> float:
    """Return a finite number from JSON."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf:
        raise Unreadable(f"{_short(value)} is not a finite number")
    return float(value)


def integer(value: Any, least: int = 0, most: int = 2**53) -> int:
    """Return an integer in [least, most] from JSON."""
    if number(value) != int(value) or not least <= value <= most:
        raise Unreadable(f"{_short(value)} is not an integer in [{least}, {most}]")
    return int(value)


def class_name(text: Any) -> str:
    """Return ``module.Class`` from ``"<class 'module.Class'>"``, or ``""`` for other text."""
    match = re.fullmatch(r"<class '([^']+)'>", text) if isinstance(text, str) else None
    return match[1] if match else ""


def constructed_class(value: Any) -> str:
    """Return the class whose constructor is named in the readable text of a pickled class, or ``""``."""
    written = value.get("__init__") if isinstance(value, dict) else None
    match = re.match(r"<function (\w+)\.__init__ at 0x", written) if isinstance(written, str) else None
    return match[1] if match else ""


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}…"

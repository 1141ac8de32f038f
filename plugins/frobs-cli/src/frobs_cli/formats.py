"""Formats numbers as human-readable text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def percent(share: float | None, digits: int = 1) -> str:
    """Return ``share`` as a percentage with ``digits`` decimals, such as ``"98.4 %"``, or ``"–"`` for None."""
    return "–" if share is None else f"{100.0 * share:.{digits}f} %"


def number(value: float | None) -> str:
    """Return ``value`` as text such as ``"1,234"``, ``"123.4"`` or ``"1.23"``, or ``"–"`` for an unknown number."""
    if value is None:
        return "–"
    return f"{value:,.0f}" if abs(value) >= 1_000 else f"{value:.1f}" if abs(value) >= 100 else f"{value:.2f}"


def duration(seconds: float) -> str:
    """Return a duration in ``seconds`` [s] as text such as ``"12 s"``, ``"3:05"`` or ``"1:02:03"``."""
    rounded = round(seconds)
    if rounded < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{rounded} s"
    minutes, second = divmod(rounded, 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours}:{minute:02}:{second:02}" if hours else f"{minute}:{second:02}"


def settings_text(settings: Mapping[str, Any] | None) -> str | None:
    """Return settings as text such as ``"iterations=50, cone=elliptic"``, or None if there are none."""
    return ", ".join(f"{key}={value}" for key, value in (settings or {}).items()) or None

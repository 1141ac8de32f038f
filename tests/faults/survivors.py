"""Why a drawn fault survives, by module and what was changed: looked at one by one."""

from __future__ import annotations

from planting import Fault

REASONS: dict[tuple[str, str], str] = {}
"""By module, and a part of the change."""


def reason(fault: Fault) -> str:
    """Return why a fault survives, or that nobody has looked at it yet."""
    for (module, change), text in REASONS.items():
        if module == fault.module and change in fault.where:
            return text
    return "not looked at yet"

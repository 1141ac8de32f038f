"""The published certificate of parity has every measurement that a certificate has today."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from frobs_devkit.parity import TOLERANCES, measure

HOW_TO = Path(__file__).parents[2] / "docs" / "how-to"
MEASURED = (HOW_TO / "parity-measured.md").read_text("utf-8")
UNUSED: Any = object()
PLANS = measure._plans(file=UNUSED, run=UNUSED, episodes=1)


def test_every_measurement_was_made() -> None:
    titles = re.findall(r"^## (.+)$", MEASURED, re.MULTILINE)
    assert titles == [*(plan.title for plan in PLANS.values()), "Why these tolerances", "Versions"]


def test_every_measurement_is_explained() -> None:
    assert re.findall(r"^\| `(\w+)` \|", (HOW_TO / "parity.md").read_text("utf-8"), re.MULTILINE) == [*PLANS]


def test_the_reasons_of_tolerances_are_those_of_today() -> None:
    reasons = dict(re.findall(r"^- \*\*(.+?)\*\*: (.+)$", MEASURED, re.MULTILINE))
    assert len(reasons) >= 15
    for name, reason in reasons.items():
        assert reason == TOLERANCES[name.replace(" ", "_")].reason

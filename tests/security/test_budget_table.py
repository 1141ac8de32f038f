"""SECURITY.md lists every limit with its figure."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from frobs_models.budgets import BUDGETS

SCRIPT = Path(__file__).parents[2] / ".ci" / "budget_table.py"


def test_the_table_of_limits_equals_the_budgets():
    spec = importlib.util.spec_from_file_location("budget_table", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = module.PAGE.read_text("utf-8")
    assert page == module.written(), "run 'python .ci/budget_table.py'"
    assert sum(f"| {limit:,} |" in page for limits in BUDGETS.values() for limit in limits.values()) > 10

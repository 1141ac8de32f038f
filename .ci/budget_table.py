"""Write the table of budgets in SECURITY.md: ``python .ci/budget_table.py``."""

from __future__ import annotations

from pathlib import Path

from frobs_core.util.budgets import BUDGETS
from frobs_deploy.budgets import BUDGET

PAGE = Path(__file__).parents[1] / "SECURITY.md"
BEGIN, END = "<!-- begin budgets -->\n", "<!-- end budgets -->\n"


def table() -> str:
    """Return the table in Markdown, with one row per limit."""
    kinds = {**BUDGETS, "policy bundle": {**BUDGET, **BUDGETS["policy bundle"]}}
    rows = [
        f"| {kind} | {what} | {limit:,} |" for kind, limits in kinds.items() for what, limit in sorted(limits.items())
    ]
    return "\n".join(["| file | what is counted | limit |", "|---|---|---:|", *rows, ""])


def written() -> str:
    """Return the page with the current table."""
    head, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
    tail = rest.partition(END)[2]
    return f"{head}{BEGIN}{table()}{END}{tail}"


if __name__ == "__main__":
    PAGE.write_text(written(), "utf-8")

"""Write the table of budgets in SECURITY.md: ``python .ci/budget_table.py``."""

from __future__ import annotations

from pathlib import Path

from frobs_core.util import budgets as of_core
from frobs_data import budgets as of_data
from frobs_deploy import budgets as of_deploy
from frobs_models import budgets as of_models
from frobs_train.export import untrusted

PAGE = Path(__file__).parents[1] / "SECURITY.md"
BEGIN, END = "<!-- begin budgets -->\n", "<!-- end budgets -->\n"


def table() -> str:
    """Return the table in Markdown, with one row per limit."""
    policies = {**of_deploy.BUDGET, **untrusted.BUDGET}
    data = {"data set": of_data.BUDGET, "ROS bag": of_data.BAG_BUDGET}
    kinds = {**of_models.BUDGETS, **data, "policy bundle": policies, **of_core.BUDGETS}
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

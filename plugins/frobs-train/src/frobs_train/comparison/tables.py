"""Tables of comparisons as CSV, Markdown and LaTeX files."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from frobs_core.util.errors import ParameterValueError
from frobs_core.util.files import write_aside
from frobs_train.comparison.compare import Comparison
from frobs_train.comparison.confidence import Estimate

_ALL = "all environments"
_LATEX = str.maketrans(
    {char: f"\\{char}" for char in "&%$#_{}"}
    | {"·": r"$\cdot$", "–": "--", "\\": r"\textbackslash{}"}
    | {"^": r"\textasciicircum{}", "~": r"\textasciitilde{}", "<": r"\textless{}", ">": r"\textgreater{}"}
)

Table = Sequence[Sequence[str]]
"""Rows of cells, the first of which are the heads."""


def write_table(found: Comparison, path: Path | str, ending: str | None = None) -> Path:
    """Write a comparison as a table, and return the path.

    A ``.csv`` file has one row per run and one row per group, whose ``seed`` is ``all``, with unrounded numbers. A
    ``.md`` and a ``.tex`` file have two tables for print: the groups, and the runs. A LaTeX file contains two
    ``tabular`` environments, which need the package ``booktabs``.

    Args:
        found: Result of :func:`frobs_train.compare`.
        path: File to write.
        ending: Format. Defaults to the ending of the path.

    Raises:
        ParameterValueError: The ending is none of these.
    """
    target = Path(path)
    ending = target.suffix.lower() if ending is None else ending
    if ending == ".csv":
        text = _csv(found)
    elif ending in (".md", ".tex"):
        text = "\n".join(
            (markdown_table if ending == ".md" else _latex)(table) for table in (groups_table(found), runs_table(found))
        )
    else:
        raise ParameterValueError("table", str(path), "a file that ends in .csv, .md or .tex")
    write_aside(target, lambda aside: aside.write_text(text, "utf-8"))
    return target


def groups_table(found: Comparison) -> Table:
    """Return one row per group, and one per group over all environments."""
    reached = [] if found.threshold is None else [f"steps to {_value(found, found.threshold)}"]
    rows = [["environment", "group", "seeds", found.metric, "95 % interval", *reached]]
    for group in found.groups:
        steps = "–" if group.steps_to_threshold is None else f"{group.steps_to_threshold:,.0f}"
        rows.append(
            [
                group.environment.rpartition(":")[2],
                group.name,
                str(len(group.runs)),
                _value(found, group.final.value),
                _interval(found, group.final),
                *([steps] if reached else []),
            ]
        )
    for each in found.aggregates:
        cells = [_value(found, each.final.value), _interval(found, each.final)]
        rows.append([_ALL, each.name, str(each.runs), *cells, *(["–"] if reached else [])])
    return rows


def runs_table(found: Comparison) -> Table:
    """Return one row per run."""
    rows = [["environment", "group", "seed", found.metric, "measured in", "steps"]]
    for group in found.groups:
        for run in group.runs:
            cells = [str(run.seed), _value(found, run.final), run.source, f"{run.steps:,}"]
            rows.append([group.environment.rpartition(":")[2], group.name, *cells])
    return rows


def _csv(found: Comparison) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    heads = ["environment", "algorithm", "group", "seed", "runs", "metric", "value", "low", "high", "source", "steps"]
    table.writerow([*heads, "steps_to_threshold", "seconds"])
    for group in found.groups:
        what = [group.environment, group.algorithm, group.name]
        for run in group.runs:
            cells: list[Any] = [run.seed, 1, found.metric, run.final, None, None, run.source, run.steps]
            table.writerow([*what, *cells, run.steps_to_threshold, run.seconds])
        final = group.final
        cells = ["all", len(group.runs), found.metric, final.value, final.low, final.high, None, None]
        table.writerow([*what, *cells, group.steps_to_threshold, group.seconds])
    for each in found.aggregates:
        final = each.final
        cells = ["all", each.runs, found.metric, final.value, final.low, final.high]
        table.writerow([_ALL, each.algorithm, each.name, *cells, None, None, None, None])
    return text.getvalue()


def markdown_table(table: Table) -> str:
    """Return a table in Markdown."""
    lines = [[cell.replace("|", "\\|") for cell in row] for row in table]
    return "".join(f"| {' | '.join(row)} |\n" for row in [lines[0], ["---"] * len(lines[0]), *lines[1:]])


def _latex(table: Table) -> str:
    lines = [" & ".join(cell.translate(_LATEX) for cell in row) + r" \\" for row in table]
    begin = rf"\begin{{tabular}}{{ll{'r' * (len(table[0]) - 2)}}}"
    return "\n".join([begin, r"\toprule", lines[0], r"\midrule", *lines[1:], r"\bottomrule", r"\end{tabular}", ""])


def _value(found: Comparison, value: float) -> str:
    return f"{100.0 * value:.1f} %" if found.metric == "success" else f"{value:.4g}"


def _interval(found: Comparison, item: Estimate) -> str:
    if item.low is None or item.high is None:
        return "–"
    return f"{_value(found, item.low)} to {_value(found, item.high)}"

"""Output of commands: results to stdout, everything else to stderr."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.text import Text

_NARROWEST_PROSE = 30
"""Minimum width of the last column of a table [columns]; if less is available, its text goes below the row."""


def console(*, stderr: bool = False) -> Console:
    """Return a console as wide as the terminal. Pipes and files get lines of unlimited width."""
    from rich.console import Console

    stream = sys.stderr if stderr else sys.stdout
    made = Console(file=stream, width=None if stream.isatty() else 1_000, highlight=False, emoji=False)
    made.on_broken_pipe = _reader_gone  # type: ignore[method-assign]  # rich's own handler exits with 1, like a failed check
    return made


def _reader_gone() -> NoReturn:
    raise BrokenPipeError


def print_line(text: RenderableType = "") -> None:
    """Write something for humans to stdout."""
    console().print(text, soft_wrap=isinstance(text, str))


def print_note(text: str) -> None:
    """Write one line to stderr."""
    console(stderr=True).print(text, style="dim", markup=False, soft_wrap=True)


def print_error(text: str) -> None:
    """Write ``error: …`` to stderr."""
    from rich.text import Text

    console(stderr=True).print(Text.assemble(("error:", "bold red"), " ", text), soft_wrap=True)


@contextlib.contextmanager
def working(text: str) -> Iterator[Callable[[str], None]]:
    """Show in a terminal what a command does, and for how long; yield a function that changes the text."""
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    err = console(stderr=True)
    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(text)
        yield lambda text: bar.update(task, description=text)


def print_title(text: str, detail: str = "") -> None:
    """Write the heading of a section to stdout."""
    from rich.text import Text

    console().print(Text.assemble((text, "bold"), (f"  {detail}" if detail else "", "dim")), soft_wrap=True)


def print_table(
    columns: Sequence[str], rows: Sequence[Sequence[str | Text]], *, header: bool = True, indent: int = 2
) -> None:
    """Write a table to stdout. Its last column is wrapped, or placed below its row on a narrow terminal.

    Args:
        columns: Headings.
        rows: One text for each column.
        header: Whether to show the headings.
        indent: Indentation of each line [columns].
    """
    from rich.text import Text

    out = console()
    cells = [[cell if isinstance(cell, Text) else Text(cell) for cell in row] for row in rows]
    for row in cells:
        row[0].stylize_before("cyan")
    lines = [[Text(column, style="dim") for column in columns], *cells] if header else cells
    widths = [max((line[i].cell_len for line in lines), default=0) for i in range(len(columns))]
    start = indent + sum(width + 2 for width in widths[:-1])
    room = out.width - start if out.is_terminal else widths[-1]
    stacked = room < min(widths[-1], _NARROWEST_PROSE)
    for i, (*front, prose) in enumerate(lines):
        for cell, width in zip(front, widths[:-1], strict=True):
            cell.pad_right(width + 2 - cell.cell_len)
        wrapped = [] if stacked else list(prose.wrap(out, max(room, 1)))
        text = Text.assemble(" " * indent, *front, *wrapped[:1])
        text.rstrip()
        below = [Text.assemble(" " * start, line) for line in wrapped[1:]]
        if stacked and not (header and i == 0):
            room_below = out.width - indent - 2
            below = [Text.assemble(" " * (indent + 2), line) for line in prose.wrap(out, max(room_below, 1))]
        for line in (text, *below):
            out.print(line, soft_wrap=True)


def print_json(value: Any) -> None:
    """Write results to stdout as JSON."""
    from frobs_core.plain import plain

    sys.stdout.write(json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


@contextlib.contextmanager
def only_json(wanted: bool) -> Iterator[None]:
    """Redirect output of libraries to stderr while a command collects results that it will write as JSON."""
    if not wanted:
        yield
        return
    with contextlib.redirect_stdout(sys.stderr):
        yield

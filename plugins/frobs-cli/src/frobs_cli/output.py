"""Writes the results of commands to stdout, and everything else to stderr."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.text import Text

_NARROWEST_PROSE = 30
"""Minimum width of a table's last column [characters]. If less width is available, the column's text is placed below
the row."""


_FIRST_LINE, _LINE_EVERY = 3.0, 10.0
"""Time until the first progress line and between further ones, if stderr is not a terminal [s]."""


def console(*, stderr: bool = False) -> Console:
    """Return a console that is as wide as the terminal, or 1,000 characters wide for pipes and files."""
    from rich.console import Console

    stream = sys.stderr if stderr else sys.stdout
    made = Console(file=stream, width=None if stream.isatty() else 1_000, highlight=False, emoji=False)
    made.on_broken_pipe = _reader_gone  # type: ignore[method-assign]  # rich's own handler exits with code 1
    return made


def _reader_gone() -> NoReturn:
    raise BrokenPipeError


def print_line(text: RenderableType = "") -> None:
    """Write human-readable output to stdout."""
    console().print(text, soft_wrap=isinstance(text, str), markup=False)


def print_note(text: str) -> None:
    """Write one line to stderr."""
    console(stderr=True).print(text, style="dim", markup=False, soft_wrap=True)


def print_error(text: str) -> None:
    """Write ``error: …`` to stderr."""
    from rich.text import Text

    console(stderr=True).print(Text.assemble(("error:", "bold red"), " ", text), soft_wrap=True)


@contextlib.contextmanager
def working(text: str) -> Iterator[Callable[[str], None]]:
    """Show a progress text and the elapsed time on stderr, and yield a function that changes the text.

    A terminal shows the text at once. Elsewhere, such as in the log of a job, a line is written every few seconds, so
    quick commands write nothing.
    """
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    err = console(stderr=True)
    if not err.is_terminal:
        with _lines(text) as show:
            yield show
        return
    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    with Progress(*columns, console=err, transient=True) as bar:
        task = bar.add_task(text)
        yield lambda text: bar.update(task, description=text)


@contextlib.contextmanager
def _lines(text: str) -> Iterator[Callable[[str], None]]:
    """Write a progress line after a few seconds and then at longer intervals, from a thread of its own."""
    latest, done, begin = [text], threading.Event(), time.monotonic()

    def write() -> None:
        pause = _FIRST_LINE
        while not done.wait(pause):
            print_note(f"{latest[0]} ({time.monotonic() - begin:.0f} s)")
            pause = _LINE_EVERY

    writer = threading.Thread(target=write, name="writer", daemon=True)
    writer.start()
    try:
        yield lambda text: latest.__setitem__(0, text)
    finally:
        done.set()
        writer.join()


def print_title(text: str, detail: str = "") -> None:
    """Write the heading of a section to stdout."""
    from rich.text import Text

    console().print(Text.assemble((text, "bold"), (f"  {detail}" if detail else "", "dim")), soft_wrap=True)


def print_table(
    columns: Sequence[str], rows: Sequence[Sequence[str | Text]], *, header: bool = True, indent: int = 2
) -> None:
    """Write a table to stdout. The last column's text is wrapped, or placed below the row in a narrow terminal.

    Args:
        columns: Column headings.
        rows: Rows, each with one text per column.
        header: Whether to show the headings.
        indent: Indentation of each line [characters].
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
    from frobs_core.plain import to_json

    sys.stdout.write(to_json(value, indent=2, ascii=False) + "\n")


@contextlib.contextmanager
def only_json(wanted: bool) -> Iterator[None]:
    """Redirect the output of libraries to stderr while a command collects the results that it writes as JSON."""
    if not wanted:
        yield
        return
    with contextlib.redirect_stdout(sys.stderr):
        yield

"""Writes the results of commands to stdout, and everything else to stderr.

Text may contain names from the files of strangers, so a terminal receives no control character of a text, and Rich's
markup is not interpreted.
"""

from __future__ import annotations

import contextlib
import json
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.text import Text

_NARROWEST_PROSE = 30
"""Minimum width of a table's last column [characters]. If less width is available, the column's text is placed below
the row."""


_FIRST_LINE, _LINE_EVERY = 3.0, 10.0
"""Time until the first progress line and between further ones, if stderr is not a terminal [s]."""

_INVISIBLE = "\x7f-\x9f\xad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff\U000e0000-\U000e007f"
"""Control characters above ASCII, and characters that change the order of a text or cannot be seen."""

_UNPRINTABLE = re.compile(f"[\x00-\x08\x0b-\x1f{_INVISIBLE}]")
_NOT_IN_A_LINE = re.compile(f"[\x00-\x1f{_INVISIBLE}]")
_NOT_IN_A_MESSAGE = re.compile(f"\n(?! {{2}})|[\x00-\x08\x0b-\x1f{_INVISIBLE}]")


def one_line(text: str) -> str:
    """Escape control characters and line breaks, so that ``text`` cannot control the terminal or pose as a line."""
    return _NOT_IN_A_LINE.sub(_escape, text)


def message(text: str) -> str:
    """Escape control characters and line breaks in ``text``, except line breaks before indented lines such as rows."""
    return _NOT_IN_A_MESSAGE.sub(_escape, text)


def printable(text: str) -> str:
    """Escape control characters in ``text`` other than line breaks and tabs."""
    return _UNPRINTABLE.sub(_escape, text)


def _escape(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")


def console(*, stderr: bool = False) -> Console:
    """Return a console that is as wide as the terminal, or 1,000 characters wide for pipes and files.

    Args:
        stderr: Whether to write to stderr instead of stdout.
    """
    from rich.console import Console
    from rich.segment import Segment

    class SafeConsole(Console):
        """Console that escapes the control characters in everything that it shows."""

        def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
            """Yield the segments of an object. Segments with ``control`` move the cursor and have no text of files."""
            for text, style, control in super().render(renderable, options):
                yield Segment(text if control else printable(text), style, control)

    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() else 1_000
    made = SafeConsole(file=stream, width=width, highlight=False, emoji=False, markup=False)
    made.on_broken_pipe = _reader_gone  # type: ignore[method-assign]  # rich's own handler exits with code 1
    return made


def _reader_gone() -> NoReturn:
    raise BrokenPipeError


_SHOWN = 500
_LONG_WORD = re.compile(rf"\S{{{_SHOWN + 100},}}")
"""A word that fills the terminal, such as an argument that is the contents of a file."""


def print_line(text: RenderableType = "") -> None:
    """Write human-readable output to stdout."""
    console().print(one_line(text) if isinstance(text, str) else text, soft_wrap=isinstance(text, str), markup=False)


def print_note(text: str) -> None:
    """Write ``text`` as one line to stderr."""
    console(stderr=True).print(one_line(text), style="dim", soft_wrap=True)


def print_error(text: str) -> None:
    """Write ``error:`` and ``text`` to stderr. Only indented lines, such as table rows, may follow the first line."""
    from rich.text import Text

    short = _LONG_WORD.sub(lambda word: f"{word[0][:_SHOWN]}…", text)
    console(stderr=True).print(Text.assemble(("error:", "bold red"), " ", message(short)), soft_wrap=True)


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
        task = bar.add_task(one_line(text))
        yield lambda text: bar.update(task, description=one_line(text))


@contextlib.contextmanager
def _lines(text: str) -> Iterator[Callable[[str], None]]:
    """Write a progress line after a few seconds and then at longer intervals, from a separate thread."""
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
    """Write the heading of a section, ``text`` and less visible ``detail``, to stdout."""
    from rich.text import Text

    heading = Text.assemble((one_line(text), "bold"), (f"  {one_line(detail)}" if detail else "", "dim"))
    console().print(heading, soft_wrap=True)


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
    cells = [[as_cell(cell) for cell in row] for row in rows]
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


def as_cell(text: str | Text) -> Text:
    """Return the text of a table's cell as a single line."""
    from rich.text import Text

    if isinstance(text, Text):
        return Text(one_line(text.plain), text.style) if _NOT_IN_A_LINE.search(text.plain) else text
    return Text(one_line(text))


def print_json(value: Any) -> None:
    """Write results to stdout as JSON."""
    from frobs_core.util.plain import to_json

    text = to_json(value, indent=2, ascii=False)
    sys.stdout.write(_UNPRINTABLE.sub(_escape_in_json, text) + "\n")


def _escape_in_json(found: re.Match[str]) -> str:
    return json.dumps(found[0], allow_nan=False)[1:-1]


@contextlib.contextmanager
def only_json(enabled: bool) -> Iterator[None]:
    """If ``enabled``, redirect the output of libraries to stderr while a command collects what it writes as JSON."""
    if not enabled:
        yield
        return
    with contextlib.redirect_stdout(sys.stderr):
        yield

"""Pieces of reStructuredText."""

import re
from collections.abc import Iterable, Sequence
from textwrap import indent


def escape(text: object) -> str:
    """Return text that is shown as it is."""
    return re.sub(r"([\\*`_|])", r"\\\1", str(text))


def code(text: object) -> str:
    """Return text set as code; nothing where there is none."""
    return f"``{text}``" if str(text) else ""


def heading(text: str, underline: str = "=") -> str:
    """Return a heading; ``=`` is the page's, ``-`` and ``~`` are below."""
    return f"{text}\n{underline * max(len(text), 4)}\n\n"


def label(name: str) -> str:
    """Return a target that pages may refer to."""
    return f".. _{name}:\n\n"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], widths: str = "auto") -> str:
    """Return a table whose cells are reStructuredText; without a head its first column is one."""
    lines = [".. list-table::", "   :header-rows: 1" if head else "   :stub-columns: 1", f"   :widths: {widths}", ""]
    for row in [head, *rows] if head else rows:
        for i, cell in enumerate(row):
            first, *rest = cell.split("\n") if cell else [""]
            lines.append(f"   {'*' if i == 0 else ' '} - {first}".rstrip())
            lines.extend(f"       {line}".rstrip() for line in rest)
    return "\n".join(lines) + "\n\n"


def literal(text: str, language: str = "text") -> str:
    """Return a block of code."""
    return f".. code-block:: {language}\n\n{indent(text.strip(), '   ')}\n\n"


def directive(name: str, argument: str, **options: str) -> str:
    """Return a directive without content."""
    lines = [f".. {name}:: {argument}"] + [
        f"   :{key.rstrip('_').replace('_', '-')}: {value}" for key, value in options.items()
    ]
    return "\n".join(lines) + "\n\n"


def toctree(names: Iterable[str], **options: str) -> str:
    """Return a table of contents of pages in this folder."""
    return directive("toctree", "", maxdepth="1", **options).rstrip() + "\n\n   " + "\n   ".join(names) + "\n\n"

"""Run the fenced blocks of a page in order, in the present folder: ``run_blocks.py PAGE [--draw]``.

Python blocks share one namespace, as in one session; bash blocks share the folder. A block with ``skip="why"`` is left
out, one with ``needs="rendering"`` too unless ``--draw`` is given, and one with ``file="name"`` is written there. A page with
a block ``venv="own"`` installs something: the tests run it in an environment of its own. A block with
``faster="text => other text"`` runs with this replacement: a training that is shorter, where the page runs without its result.
"""

from __future__ import annotations

import importlib
import site
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from pages import Block, blocks


def run(block: Block, namespace: dict[str, Any]) -> None:
    """Run one block; its first error ends the program."""
    where = f"{block.page.name}:{block.line}"
    text = block.text
    if "faster" in block.attributes:
        before, _, after = block.attributes["faster"].partition(" => ")
        if text.count(before) != 1:
            raise SystemExit(f"{where}: '{before}' of faster= occurs {text.count(before)} times instead of once")
        text = text.replace(before, after)
    if block.language == "bash":
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", text], stdin=subprocess.DEVNULL)
        if done.returncode:
            raise SystemExit(f"{where}: exit code {done.returncode}\n{text}")
        if sys.prefix != sys.base_prefix:  # what the block has installed is for the next one, too
            site.addsitedir(sysconfig.get_path("purelib"))
            importlib.invalidate_caches()
    elif block.language == "python":
        exec(compile("\n" * block.line + text, str(block.page), "exec"), namespace)
    elif "file" in block.attributes:
        Path(block.attributes["file"]).write_text(text, "utf-8")


def main() -> None:
    """Run a page."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(Path(sys.argv[1])):
        wanted = "rendering" not in block.attributes.get("needs", "") or "--draw" in sys.argv
        if wanted and "skip" not in block.attributes:
            run(block, namespace)


if __name__ == "__main__":
    main()

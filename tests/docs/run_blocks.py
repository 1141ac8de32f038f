"""Run the fenced blocks of a page in order, in the present folder: ``run_blocks.py PAGE [--draw]``.

Python blocks share one namespace, as in one session; bash blocks share the folder. A block with ``skip="why"`` is left
out, one with ``needs="rendering"`` too unless ``--draw`` is given, and one with ``file="name"`` is written there. A page with
a block ``venv="own"`` installs something: the tests run it in an environment of its own.
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

SHORTER = {
    "README.md": ("train(config, ", "train(config.model_copy(update={'steps': 20_000}), "),
    "first-robot.md": ("--seed 0 --run-dir runs/first", "--seed 0 --run-dir runs/first --steps 20_000"),
    "own-plugin.md": ("--seed 0 --run-dir runs/my_arm", "--seed 0 --run-dir runs/my_arm --steps 20_000"),
}
"""Page, text, and what replaces it in tests: a shorter training. Other tests run these trainings to their end."""


def run(block: Block, namespace: dict[str, Any]) -> None:
    """Run one block; its first error ends the program."""
    where = f"{block.page.name}:{block.line}"
    text = block.text.replace(*SHORTER.get(block.page.name, ("", "")))
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

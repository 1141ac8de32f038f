"""Type the fenced blocks of a page in order, in the present folder: ``run_blocks.py PAGE [--without PART ...]``.

All bash blocks are typed into one shell, so they share its folder and its variables. Python blocks share one namespace,
and run in the folder of the shell. A block with ``skip="why"`` is left out, one with ``needs="PART"`` too if the part is
named, and one with ``file="name"`` is written to that file.
"""

from __future__ import annotations

import importlib
import os
import site
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from pages import Block, blocks

SHORTER: dict[str, dict[str, str]] = {
    "arm-on-your-desk.md": {
        "--run-dir runs/bracket\n": "--run-dir runs/bracket --steps 12_800 --set algorithm_config.final_updates=200\n",
        "--episodes 200": "--episodes 20",
    },
    "README.md": {"train(config, ": "train(config.model_copy(update={'steps': 20_000}), "},
    "choose-parts.md": {
        "simulator_kwargs.cone=elliptic": "simulator_kwargs.cone=elliptic --steps 2_048",
        "--robot my_arm.urdf --tcp tool0": "--robot my_arm.urdf --tcp tool0 --steps 2_048",
    },
    "first-robot.md": {"--run-dir runs/first\n": "--run-dir runs/first --steps 20_000\n"},
    "grippers.md": {"steps: 800_000": "steps: 2_048", "--episodes 1_000": "--episodes 10"},
    "look-at-your-robot.md": {
        "frobs view my_arm.urdf": "frobs view my_arm.urdf --seconds 1",
        "frobs view runs/my_arm": "frobs view runs/my_arm --seconds 1",
        "--run-dir runs/my_arm\n": "--run-dir runs/my_arm --steps 4_096\n",
    },
    "manipulation.md": {"--algorithm sac\n": "--algorithm sac --steps 500\n"},
    "own-plugin.md": {"--run-dir runs/my_arm\n": "--run-dir runs/my_arm --steps 20_000\n"},
    "paced-simulators.md": {"--episodes 100": "--episodes 1"},
    "pixels.md": {"steps: 150_000": "steps: 1_024", "--episodes 1_000": "--episodes 4"},
    "send-a-page.md": {"--run-dir runs/reach\n": "--run-dir runs/reach --steps 4_096\n"},
    "teach-a-robot-to-see.md": {
        "--run-dir runs/seeing\n": "--run-dir runs/seeing --steps 800 --set num_envs=4 --set algorithm_config.updates=5 "
        "--set algorithm_config.final_updates=5\n",
        "--episodes 200": "--episodes 4",
        "--episodes 2 --video": "--episodes 1 --video",
        "NUM_ENVS = 32": "NUM_ENVS = 4",
        "assert seeing > 0.9 and blind < 0.2": "assert blind < 0.2",
        "frobs view runs/seeing\n": "frobs view runs/seeing --seconds 1\n",
    },
    "teach-a-robot.md": {
        "--seed 0 --run-dir runs/clone": "--seed 0 --run-dir runs/clone --set algorithm_config.torch_threads=1",
        "--run-dir runs/dagger\n": "--run-dir runs/dagger --steps 6_400 --set algorithm_config.final_updates=200\n",
    },
    "train.md": {"--log wandb": "--log wandb --steps 4_096"},
    "write-an-algorithm.md": {"--num-threads 1": "--num-threads 1 --n-timesteps 2_048"},
}
"""Page, text, and its replacement in tests: a shorter training. Other tests run most of these trainings to their end."""


class Terminal:
    """A shell that ends at the first command that fails."""

    def __init__(self) -> None:
        self._done, done = os.pipe()
        self._shell = subprocess.Popen(
            ["bash", "-euo", "pipefail"], stdin=subprocess.PIPE, pass_fds=[done], text=True, bufsize=1
        )
        self._report = f"pwd >&{done}"
        os.close(done)

    def type(self, text: str) -> None:
        """Run commands, and change to the folder in which the shell is afterwards.

        Raises:
            SystemExit: A command failed.
        """
        assert self._shell.stdin is not None
        self._shell.stdin.write(f"{{\n{text}\n}} </dev/null\n{self._report}\n")
        folder = os.read(self._done, 4096).decode().rstrip("\n")
        if not folder:
            raise SystemExit(f"exit code {self._shell.wait()}")
        os.chdir(folder)


def run(block: Block, terminal: Terminal, namespace: dict[str, Any]) -> None:
    """Run one block; its first error ends the program."""
    text = block.text
    for long, short in SHORTER.get(block.page.name, {}).items():
        text = text.replace(long, short)
    if block.language == "bash":
        try:
            terminal.type(text)
        except SystemExit as error:
            raise SystemExit(f"{block.page.name}:{block.line}: {error}\n{text}") from None
        site.addsitedir(sysconfig.get_path("purelib"))  # for what the block has installed
        importlib.invalidate_caches()
    elif block.language == "python":
        exec(compile("\n" * block.line + text, str(block.page), "exec"), namespace)
    elif "file" in block.attributes:
        Path(block.attributes["file"]).write_text(text, "utf-8")


def main() -> None:
    """Run a page."""
    sys.path[0] = ""  # as in a Python that was started without a file
    terminal = Terminal()
    namespace: dict[str, Any] = {"__name__": "__main__"}
    page, *without = [argument for argument in sys.argv[1:] if argument != "--without"]
    for block in blocks(Path(page)):
        if not set(without) & set(block.attributes.get("needs", "").split()) and "skip" not in block.attributes:
            run(block, terminal, namespace)


if __name__ == "__main__":
    main()

"""The files of FRobs that a step runs, traced while the documentation is built."""

import ast
import sys
from pathlib import Path
from types import FrameType
from typing import Any

import gymnasium as gym
from layers import ROOT, distributions

ID = "frobs/Irb120Reach-v0"
"""The environment whose step is traced, in MuJoCo."""
_WRAPPERS = ROOT / "frobs_core" / "wrappers"


def traced_files() -> list[Path]:
    """Return the files of FRobs, relative to the repository, that one step of ``ID`` runs, without the wrappers."""
    env = gym.make(f"frobs_core:{ID}", simulator="mujoco")
    env.reset(seed=0)
    action = env.action_space.sample()
    env.step(action)  # the first step may still import something
    packages = [package for distribution in distributions().values() for package in distribution.packages]
    found = dict.fromkeys(path for path in _files_of(lambda: env.step(action)) if path.is_absolute())
    env.close()
    ours = [path for path in found if any(package in path.parents for package in packages)]
    return [path.relative_to(ROOT) for path in ours if _WRAPPERS not in path.parents]


def fragment() -> str:
    """Return the list as Markdown, for a page to include."""
    files = traced_files()
    lines = [f"One step of `{ID}` in MuJoCo runs code in {len(files)} files of FRobs, not counting wrappers:", ""]
    lines += ["| file | contents |", "|---|---|"]
    return "\n".join([*lines, *(f"| `{path}` | {_summary(path)} |" for path in files), ""])


def _summary(path: Path) -> str:
    """Return the first line of a module's docstring."""
    text = ast.get_docstring(ast.parse((ROOT / path).read_text("utf-8"))) or ""
    return text.partition("\n")[0].replace("``", "`").replace("|", "\\|")


def _files_of(function: Any) -> list[Path]:
    """Call a function and return the file of each Python function that it called, in the order of the calls."""
    found: dict[str, None] = {}

    def record(frame: FrameType, event: str, argument: Any) -> None:
        if event == "call":
            found.setdefault(frame.f_code.co_filename)

    earlier = sys.getprofile()
    sys.setprofile(record)
    try:
        function()
    finally:
        sys.setprofile(earlier)
    return [Path(name) for name in found]

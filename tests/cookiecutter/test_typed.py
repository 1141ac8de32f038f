"""What is rendered is typed: ``mypy --strict`` finds nothing in it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from sandbox import ROOT, distributions

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("what", ["pair", "controller", "simulator", "paced simulator", "algorithm"])
def test_a_new_plugin_is_strictly_typed(new: Any, tmp_path: Path, what: str) -> None:
    paced = {"paced": "yes"} if what.startswith("paced") else {}
    folders = distributions(new(what=what.removeprefix("paced "), name="my_part", **paced))
    sources = [folder / "src" for folder in folders]
    assert all(list(source.glob("*/py.typed")) for source in sources)
    # Tests of the other kinds import the whole kit, whose dependencies take minutes to check.
    checked = [*sources, *(folder / "tests" for folder in folders if what == "pair")]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", ROOT / ".mypy_cache", *checked],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": os.pathsep.join(map(str, sources))},
        text=True,
        capture_output=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stdout + done.stderr

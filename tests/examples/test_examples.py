"""The examples run, each in an environment with the packages that it names."""

from __future__ import annotations

import ast
import json
import re
import shlex
from pathlib import Path

import pytest
from reader_environment import ReaderEnvironment

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
NOTEBOOK = EXAMPLES / "first_steps.ipynb"
STEPS = "2_048"
"""Steps of a training run that only has to run."""

WARNINGS = (
    "error",
    "ignore::DeprecationWarning",
    "ignore::FutureWarning",
)  # libraries of other authors deprecate names


def docstring(script: Path) -> str:
    return ast.get_docstring(ast.parse(script.read_text("utf-8"))) or ""


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_runs_with_the_packages_that_it_names(script: Path, tmp_path: Path) -> None:
    line = re.search(r"^Requires: pip install (.+)$", docstring(script), re.MULTILINE)
    assert line, "the docstring must have a line 'Requires: pip install …'"
    environment = ReaderEnvironment(tmp_path / "venv", *shlex.split(line[1]))
    filters = [part for warning in WARNINGS for part in ("-W", warning)]
    done = environment.run("python", *filters, script, STEPS, cwd=tmp_path)
    assert done.stdout
    assert not re.search(r"^failed", done.stdout, re.MULTILINE)


@pytest.mark.slow
def test_the_cells_of_the_notebook_run_in_order(tmp_path: Path) -> None:
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    environment = ReaderEnvironment(tmp_path / "venv", "frobs")
    (tmp_path / "cells.py").write_text(f"import os\nos.environ.update(MPLBACKEND='agg', STEPS='{STEPS}')\n{code}\n")
    assert "success" in environment.run("python", "cells.py", cwd=tmp_path).stdout


def test_the_outputs_of_the_notebook_are_cleared() -> None:
    cells = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells if "outputs" in cell)


def test_the_readme_lists_every_example() -> None:
    listed = re.findall(r"^\| \[`(.+?)`\]\(\1\)", (EXAMPLES / "README.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(
        path.name for path in EXAMPLES.iterdir() if path.is_file() and path.name != "README.md"
    )

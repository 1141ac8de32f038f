"""The examples run, each in an environment with the packages that it names."""

from __future__ import annotations

import ast
import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from reader_environment import ReaderEnvironment

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))
SHORT = {"STEPS": "2_048", "EPISODES": "4", "STEPS_OF_DAGGER": "12_800"}
"""Environment variables that shorten the notebooks."""
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
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)
def test_the_cells_of_a_notebook_run_in_order(notebook: Path, tmp_path: Path) -> None:
    code = "\n".join("".join(cell["source"]) for cell in code_cells(notebook))
    environment = ReaderEnvironment(tmp_path / "venv", "frobs[data,imitation]")
    (tmp_path / "cells.py").write_text(f"import os\nos.environ.update(MPLBACKEND='agg', **{SHORT})\n{code}\n")
    assert "success" in environment.run("python", "cells.py", cwd=tmp_path).stdout


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)
def test_a_notebook_has_the_outputs_of_one_run_without_errors(notebook: Path) -> None:
    cells = code_cells(notebook)
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs} <= {"stream", "display_data"}
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2
    assert not [text for output in outputs for text in output.get("text", []) if "/home/" in text or "/work/" in text]


def code_cells(notebook: Path) -> list[dict[str, Any]]:
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def test_the_readme_lists_every_example() -> None:
    listed = re.findall(r"^\| \[`(.+?)`\]\(\1\)", (EXAMPLES / "README.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(
        path.name for path in EXAMPLES.iterdir() if path.is_file() and path.name != "README.md"
    )

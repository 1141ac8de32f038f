"""Plugins of version 0.2 work unchanged: those in this folder, and a pair that its scaffold generated."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from clean import FROBS, HERE, PLUGINS, ROOT, Environment, imports
from wheels import build_wheels, frobs_wheels

from frobs_core.deprecation import MOVED

PAIR = HERE / "scaffold_0.2"


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    environment = Environment(tmp_path_factory.mktemp("scaffold"))
    wanted = ("frobs-core", *FROBS, "frobs-controllers", "frobs-sim-mujoco")
    wheels = {path.name.split("-")[0].replace("_", "-"): path for path in frobs_wheels(tmp_path_factory)}
    environment.install(*(wheels[name] for name in wanted))
    environment.install(*build_wheels(sorted(PAIR.glob("frobs-*")), tmp_path_factory.mktemp("pair")))
    return environment


def test_every_module_that_they_import_was_public_in_0_2() -> None:
    modules = {
        module
        for folder in (PAIR, *PLUGINS)
        for path in folder.rglob("*.py")
        for module, _ in imports(path)
        if module.startswith("frobs_core.")
    }
    assert {"frobs_core.interfaces", "frobs_core.specs"} <= modules <= MOVED.keys()


def test_the_script_of_the_porting_guide_replaces_the_imports(tmp_path: Path) -> None:
    guide = (ROOT / "docs" / "how-to" / "port-from-0.2.md").read_text("utf-8")
    script = tmp_path / "port_imports.py"
    script.write_text(guide.partition('```python file="port_imports.py"')[2].partition("```")[0])
    folder = shutil.copytree(PAIR / "frobs-tasks-my-arm" / "src", tmp_path / "src")
    files = sorted(folder.rglob("*.py"))
    subprocess.run([sys.executable, script, *files], check=True)
    now = [one for path in files for one in imports(path)]
    assert ("frobs_core.contracts", "Task") in now
    assert ("frobs_core.description", "ObservationTerm") in now
    assert not [one for one in now if one[0] in MOVED and one[0] != "frobs_core.models"]
    environment = {**os.environ, "PYTHONPATH": str(folder), "FROBS_DEPRECATIONS": "error"}
    command = [sys.executable, "-W", "error::DeprecationWarning", "-c", "import frobs_tasks_my_arm.task"]
    subprocess.run(command, check=True, env=environment)


@pytest.mark.slow
@pytest.mark.parametrize("part", ["frobs-robots-my-arm", "frobs-tasks-my-arm"])
def test_the_pair_passes_its_own_tests_and_learns_what_to_change(clean: Environment, part: str) -> None:
    done = clean.run("-m", "pytest", str(PAIR / part), "-p", "no:cacheprovider")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "use frobs_core.plugins.records." in done.stdout, done.stdout

"""Installing or importing FRobs changes nothing in other Python processes."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest
from clean import Environment
from wheels import frobs_wheels

SHOW_STATE = """
import json, os, sys
print(json.dumps([[repr(finder) for finder in sys.meta_path], sys.path, dict(os.environ), sorted(sys.modules)]))
"""

IMPORT_ALL = """
import importlib, os, sys
import gymnasium, yaml  # whatever libraries of others change is theirs
before = sys.meta_path[:], sys.path_hooks[:], sys.path[:], dict(os.environ)
for name in {names}:
    importlib.import_module(name)
assert before == (sys.meta_path, sys.path_hooks, sys.path, dict(os.environ))
"""

pytestmark = pytest.mark.slow


def state(environment: Environment) -> list[Any]:
    """Return the finders, the path, the variables and the modules of a fresh interpreter."""
    return json.loads(environment.run("-c", SHOW_STATE).stdout)


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Wheels of every distribution of this repository."""
    return frobs_wheels(tmp_path_factory)


def test_no_wheel_has_a_file_that_python_reads_at_its_start(wheels: list[Path]) -> None:
    for wheel in wheels:
        names = zipfile.ZipFile(wheel).namelist()
        assert not [name for name in names if name.endswith((".pth", "sitecustomize.py", "usercustomize.py"))]


def test_a_fresh_interpreter_is_the_same_before_and_after_all_distributions_are_installed(
    wheels: list[Path], tmp_path: Path
) -> None:
    environment = Environment(tmp_path)
    before = state(environment)
    environment.install(*wheels)
    assert state(environment) == before

    packages = {name.partition("/")[0] for wheel in wheels for name in zipfile.ZipFile(wheel).namelist()}
    names = {name for name in packages if name.isidentifier()}
    names |= {"frobs_rl.common.ros_gazebo", "frobs_rl.envs.robot_BasicEnv", "frobs_rl_compat.legacy"}
    done = environment.run("-W", "error", "-c", IMPORT_ALL.format(names=sorted(names)))
    assert done.returncode == 0, done.stderr

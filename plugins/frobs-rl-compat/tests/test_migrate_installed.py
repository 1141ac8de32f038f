"""What ``frobs migrate`` makes installs, loads, and passes its own tests, but for what it says is left to do."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from frobs_core.util.yaml import load_yaml
from frobs_rl_compat.migrate import migrate_package

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
ORIGINALS = Path(__file__).parents[4] / "shared" / "frobs_rl" / "originals"
MAZE = "frobs_rl_resources/kobuki_maze/kobuki_maze_rl"
REACHER = "frobs_rl_resources/abb_irb140_reacher/abb_irb140_reacher"
STEPS = 300
"""Of a training that only has to run."""

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("package", "tests"),
    [
        (HERE / "old_gym_package", ""),
        (HERE / "gymnasium_package", "test_plugin or test_robot or elements_vary"),  # its task is that of the other
        (EXAMPLES / "abb_irb120_reacher", ""),
        (EXAMPLES / "kobuki_maze_rl", ""),
        pytest.param(ORIGINALS / MAZE, "test_plugin or record_is_sound", marks=pytest.mark.needs("originals")),
        pytest.param(ORIGINALS / REACHER, "test_plugin or record_is_sound", marks=pytest.mark.needs("originals")),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_a_migrated_package_installs_loads_trains_and_fails_only_what_it_says(
    package, tests, fast_sandbox, tmp_path, monkeypatch
):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # small networks learn fastest so, and far faster where other tests run
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ORIGINALS))
    made = migrate_package(package, tmp_path / "plugins")
    fast_sandbox.install([made.path])

    plugins = json.loads(fast_sandbox.run("frobs", "plugins", "--json").stdout)["plugins"]
    mine = next(plugin for plugin in plugins if plugin["name"] == package.name)
    assert mine["state"] == "loaded"
    id = load_yaml(made.path / "train.yaml")["environment"]
    environments = json.loads(fast_sandbox.run("frobs", "list", "envs", "--json").stdout)["environments"]
    assert id in [environment["id"] for environment in environments]

    told = fast_sandbox.run(
        "pytest", "-q", "-rf", "-p", "no:cacheprovider", "--color=no", "-k", tests, made.path, check=False
    ).stdout
    failed = re.findall(r"^FAILED \S+::(\w+)\[(\w+)\]", told, re.MULTILINE)
    announced = re.findall(r"`(\w+)` tests fail", (made.path / "MIGRATION.md").read_text())
    assert re.search(r"\d+ passed", told), told[-3000:]
    assert {check for _, check in failed} == set(announced), told[-3000:]
    assert not [test for test, _ in failed if test in ("test_plugin", "test_robot")]

    run = tmp_path / "run"
    arguments = ["--config", made.path / "train.yaml", "--steps", STEPS, "--seed", 0, "--run-dir", run]
    fast_sandbox.run("frobs", "train", id, *arguments)
    assert json.loads(fast_sandbox.run("frobs", "evaluate", run, "--episodes", 1, "--json").stdout)["episodes"] == 1

"""What is rendered installs, passes its own tests and trains, without an edit."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from combinations import FILE, combinations, label
from sandbox import ROOT, Sandbox, distributions
from wheels import frobs_wheels, locked, shared_folder

from frobs_core.util.yaml import load_yaml
from frobs_devkit.scaffold import render, resolve

pytestmark = pytest.mark.slow

ARM = ROOT / "templates" / "my_arm.urdf.xacro"
ROWS = combinations()
STEPS = 2_000
"""Of a training that only has to run."""


def _folder(row: Mapping[str, str]) -> str:
    return f"row_{row['name']}"


@pytest.fixture(scope="module")
def shared_sandbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sandbox]:
    """One environment for all tests and workers."""
    shared = shared_folder(tmp_path_factory, "together")
    with locked(shared):
        sandbox = Sandbox(shared / "venv")
    with sandbox.faster(tmp_path_factory.mktemp("programs") / "bin"):
        yield sandbox


@pytest.fixture
def together(shared_sandbox: Sandbox, isolated_plugins: Any) -> tuple[Sandbox, Path]:
    """The environment with every combination in it; and the folder they lie in."""
    shared = shared_sandbox.folder.parent
    with locked(shared):
        done = shared / "done"
        if not done.exists():
            made = [render(resolve({"what": "robot", "example": "wheeled", "name": "my_rover"}), shared / "my_rover")]
            isolated_plugins(installed=True, my_rover="rover_plugin")
            for row in ROWS:
                answers = {**row, **({"robot_file": str(ARM)} if row.get("robot_file") == FILE else {})}
                made.append(render(resolve(answers), shared / _folder(row)))
            (rover,) = distributions(made[0])
            for file in shared.rglob("pyproject.toml"):  # the rover of this process is the one that is installed there
                file.write_text(file.read_text().replace("isolated-plugins", rover.name))
            shared_sandbox.install([place for folder in made for place in distributions(folder)])
            done.touch()
    return shared_sandbox, shared


@pytest.mark.parametrize("row", ROWS, ids=label)
def test_every_pair_of_answers_passes_its_tests_and_trains(
    row: Mapping[str, str], together: tuple[Sandbox, Path], tmp_path: Path
) -> None:
    sandbox, shared = together
    (folder,) = (shared / _folder(row)).iterdir()
    done = sandbox.run("pytest", "-q", "-p", "no:cacheprovider", folder)
    assert " passed" in done.stdout
    configuration = folder / "train.yaml"
    paced = row.get("paced") == "yes"
    assert configuration.exists() == (not paced and (row["what"] != "robot" or row["example"] != "wheeled"))
    if configuration.exists():
        id = load_yaml(configuration)["environment"]
        run = tmp_path / "run"
        sandbox.run("frobs", "train", id, "--config", configuration, "--steps", STEPS, "--seed", 0, "--run-dir", run)
        told = sandbox.run("frobs", "evaluate", run, "--episodes", 4, "--json").stdout
        assert json.loads(told)["episodes"] == 4
    elif paced:
        policy = ("frobs/Irb120Reach-v0", "--pretrained", "--simulator", row["name"])
        told = sandbox.run("frobs", "evaluate", *policy, "--episodes", 2, "--json").stdout
        assert json.loads(told)["success_rate"] == 1.0


def test_all_of_them_live_together(together: tuple[Sandbox, Path]) -> None:
    sandbox, _ = together
    told = json.loads(sandbox.run("frobs", "plugins", "--json").stdout)
    assert [plugin["name"] for plugin in told["plugins"] if plugin["state"] != "loaded"] == []
    ids = {
        environment["id"]
        for environment in json.loads(sandbox.run("frobs", "list", "envs", "--json").stdout)["environments"]
    }
    wanted = {resolved["__id"] for resolved in map(resolve, _without_files()) if resolved["__id"]}
    assert wanted <= ids


def _without_files() -> list[dict[str, str]]:
    return [{**row, **({"robot_file": str(ARM)} if "robot_file" in row else {})} for row in ROWS]


def test_from_wheels_alone_a_pair_is_made_installed_tested_and_learned(
    sandbox: Sandbox, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The five commands, with the core as a wheel: its templates travel with it."""
    sandbox.run("pip", "install", "-q", "--force-reinstall", *frobs_wheels(tmp_path_factory))
    where = "import frobs_core, sys; sys.stdout.write(frobs_core.__file__)"
    assert Path(sandbox.run("python", "-c", where, cwd=tmp_path).stdout).is_relative_to(sandbox.folder)
    told = json.loads(sandbox.run("frobs", "new", "pair", "my_arm", "--json", cwd=tmp_path).stdout)
    install, test, train, evaluate = told["next"]
    sandbox.run(*shlex.split(install.replace("-e ", "")), cwd=tmp_path)
    sandbox.run(*test.split(), cwd=tmp_path)
    made = f"import gymnasium; gymnasium.make('frobs_core:{told['environment_id']}').reset(seed=0)"
    sandbox.run("python", "-W", "error", "-c", made, cwd=tmp_path)
    sandbox.run(*train.split(), cwd=tmp_path)
    found = json.loads(sandbox.run(*evaluate.split(), "--episodes", 500, "--json", cwd=tmp_path).stdout)
    assert found["success_rate"] >= 0.95, found


@pytest.mark.needs("pybullet_data")
@pytest.mark.parametrize("file", ["xarm/xarm6_robot.urdf", "kuka_iiwa/model.urdf"])
def test_a_pair_from_an_unknown_arm_learns_to_reach(file: str, new: Any, sandbox: Sandbox, tmp_path: Path) -> None:
    import pybullet_data as data

    folder = new(what="pair", name="some_arm", example="file", robot_file=str(Path(data.getDataPath()) / file))
    sandbox.install(distributions(folder))
    sandbox.run("pytest", "-q", folder / "frobs-robots-some-arm")
    run = tmp_path / "run"
    configuration = folder / "train.yaml"
    sandbox.run("frobs", "train", "lab/SomeArmReach-v0", "--config", configuration, "--seed", 0, "--run-dir", run)
    found = json.loads(sandbox.run("frobs", "evaluate", run, "--episodes", 1000, "--json").stdout)
    assert found["success_rate"] >= 0.9, found


def test_a_sandbox_leaves_this_environment_alone(sandbox: Sandbox) -> None:
    where = "import sys; sys.stdout.write(sys.prefix)"
    assert sandbox.run("python", "-c", where).stdout == str(sandbox.folder)
    assert sys.prefix != str(sandbox.folder)

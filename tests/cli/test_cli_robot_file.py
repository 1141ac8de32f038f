"""Options that state a gripper, robot files, and what commands print and store about them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from gripper_arms import arm, robot, two_fingers
from typer.testing import Result

from frobs_core.kernel.robot_file import read_robot_file
from frobs_core.util.yaml import load_yaml

Frobs = Callable[..., Result]
PICK = "frobs/PickAndPlace-v0"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The model file of an arm with four axes."""
    path = tmp_path_factory.mktemp("arm") / "four.urdf"
    path.write_text(robot(arm(4), two_fingers()))
    return str(path)


def test_the_doctor_writes_a_robot_file_once(frobs: Frobs, file: str, tmp_path: Path) -> None:
    written = tmp_path / "robot.yaml"
    command = ["doctor", "robot", file, "--gripper", "left", "--simulator", "mujoco", "--write", str(written)]
    assert frobs(*command).exit_code == 0
    text = written.read_text()
    assert load_yaml(written)["gripper"]["gap"] == [0.0, 0.08]
    for comment in ("# Distance between the pads of the closed and of the open gripper [m].", "# home: {", "# tcp: "):
        assert comment in text
    assert max(map(len, text.splitlines())) < 121
    report = json.loads(frobs("doctor", "robot", str(written), "--simulator", "mujoco", "--json").stdout)
    assert (report["gripper"]["joints"], report["file"]) == (["left"], file)
    result = frobs(*command)
    assert (result.exit_code, "exists already" in result.stderr) == (2, True)


def test_the_doctor_writes_a_robot_file_for_another_one(frobs: Frobs, file: str, tmp_path: Path) -> None:
    attach = {"robot": "two_finger_hand", "link": "palm", "rpy": [0.0, 0.0, 0.1]}
    own = {"robot": file, "tcp": "palm", "home": {"j2": 0.3}, "attach": attach, "gripper": {"joints": ["left"]}}
    (tmp_path / "own.yaml").write_text(json.dumps(own))
    (tmp_path / "below").mkdir()
    written = tmp_path / "below" / "written.yaml"
    done = frobs("doctor", "robot", str(tmp_path / "own.yaml"), "--simulator", "mujoco", "--write", str(written))
    assert done.exit_code == 0, done.stderr
    again = read_robot_file(written)
    assert [again[key] for key in ("robot", "tcp", "home", "attach")] == [file, "palm", {"j2": 0.3}, attach]
    assert again["gripper"]["joints"] == ["left"]


def test_the_doctor_names_the_joints_that_exist(frobs: Frobs, file: str) -> None:
    result = frobs("doctor", "robot", file, "--gripper", "lft")
    assert result.exit_code == 2
    assert "no actuated joint of 'r' is named 'lft'. Did you mean 'left'?" in result.stderr


def test_the_doctor_names_the_links_that_exist(frobs: Frobs, file: str, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(f"robot: {file}\ntcp: plam\n")
    result = frobs("doctor", "robot", str(tmp_path / "robot.yaml"), "--simulator", "mujoco")
    assert (result.exit_code, "no link of 'r' is named 'plam'. Did you mean 'palm'?" in result.stderr) == (2, True)


def test_show_uses_the_options_of_a_model_file(frobs: Frobs, file: str, tmp_path: Path) -> None:
    for option, name in (("--tcp", "nope"), ("--gripper", "lft")):
        result = frobs("show", file, option, name)
        assert (result.exit_code, f"is named '{name}'" in result.stderr) == (2, True), result.stderr
    [facts] = json.loads(frobs("show", file, "--gripper", "left", "--json").stdout)
    assert {row["group"]: row["joints"] for row in facts["groups"]}["gripper"] == ["left"]
    (tmp_path / "robot.yaml").write_text(f"robot: {file}\nhome: {{nope: 1.0}}\n")
    result = frobs("show", str(tmp_path / "robot.yaml"))
    assert (result.exit_code, "is named 'nope'" in result.stderr) == (2, True), result.stderr


def test_show_lists_what_was_found_and_fitted(frobs: Frobs, file: str) -> None:
    [facts] = json.loads(frobs("show", PICK, "--robot", file, "--json").stdout)
    rows = {row["setting"]: row for row in facts["found_and_fitted"]}
    assert rows["gripper.gap"]["value"] == [0.0, 0.08]
    assert rows["size"] == {"setting": "size", "value": 0.04, "help": "Edge length of the cube [m]"}
    assert {"area", "center", "tolerance", "home", "grasp.yaw", "controller_kwargs.max_delta"} <= rows.keys()
    assert facts["action_space"].startswith("Box (4,)")
    result = frobs("show", "irb120", "--robot", file)
    assert (result.exit_code, "an environment ID is required" in " ".join(result.stderr.split())) == (2, True)


def test_train_prints_and_stores_what_was_fitted(frobs: Frobs, file: str, tmp_path: Path) -> None:
    run, short = tmp_path / "run", ["--steps", "16", "--num-envs", "2", "--set", "algorithm_config.n_steps=8"]
    more = ["--set", "algorithm_config.batch_size=16", "--set", "environment_kwargs.size=0.03", "--run-dir", str(run)]
    result = frobs("train", PICK, "--robot", file, "--gripper", "left", "--algorithm", "ppo", *short, *more)
    assert result.exit_code == 0, result.stderr
    assert "gripper.gap" in result.stderr
    kwargs = load_yaml(run / "config.yaml")["environment_kwargs"]
    assert (kwargs["fit"], kwargs["size"], kwargs["gripper"]["palm"]) == (False, 0.03, "wrist")
    assert {"area", "center", "home", "controller_kwargs"} <= kwargs.keys()

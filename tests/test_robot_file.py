"""Robot files in YAML, and grippers that are stated: nothing that is stated is derived, and nothing else changes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from expert_runs import made, success_rate
from gripper_arms import arm, joint, link, one_jaw, robot, two_fingers

from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.fitting import fit_robots, fixed_keywords
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import default_tcp, load_model
from frobs_core.plugins.registry import find_spec
from frobs_core.util.errors import ConfigurationError, ParameterValueError, PluginError
from frobs_devkit.doctor import examine_robot
from frobs_devkit.doctor.robot_file import robot_file_text
from frobs_models import find_gripper
from frobs_tasks_manipulation.pick_and_place import PickAndPlace

PICK, REACH = "frobs/PickAndPlace-v0", "frobs/Reach-v0"


def test_a_path_is_a_path() -> None:
    config = RobotConfig(robot=Path("arm.urdf"), attach=Path("hand.urdf"))  # type: ignore[arg-type]
    assert (config.robot, config.attach) == ("arm.urdf", "hand.urdf")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The model file of an arm with four axes, and the robot file that the doctor writes for it."""
    folder = tmp_path_factory.mktemp("robots")
    model, written = folder / "models" / "four.urdf", folder / "robot.yaml"
    model.parent.mkdir()
    model.write_text(robot(arm(4), two_fingers()))
    report = examine_robot(model, simulators=["mujoco"])
    written.write_text(robot_file_text(report, str(model), {}, written))
    return model, written


def episode(id: str, **keywords: Any) -> np.ndarray:
    """Return the observations of an episode of 25 steps."""
    env = gym.make(f"frobs_core:{id}", **keywords)
    env.action_space.seed(0)
    observations = [env.reset(seed=0)[0]]
    for _ in range(25):
        observations.append(env.step(env.action_space.sample())[0])
    env.close()
    return np.array(observations)


def test_a_written_file_behaves_like_the_model_file(files: tuple[Path, Path]) -> None:
    model, written = files
    assert '\nrobot: "models/four.urdf"\n' in written.read_text()
    for id in (PICK, REACH):
        np.testing.assert_array_equal(episode(id, robot=str(written)), episode(id, robot=str(model)))


def test_fixed_keywords_are_the_same_environment(files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    model, written = files
    keywords = {"robot": str(written), "size": 0.03}
    fixed = fixed_keywords({**find_spec(PICK).kwargs, **keywords})
    assert (fixed["robot"], fixed["fit"], fixed["size"]) == (str(model), False, 0.03)
    expected = episode(PICK, **keywords)
    monkeypatch.setattr("frobs_tasks_manipulation.fit.fit_task", None)  # nothing is derived again
    np.testing.assert_array_equal(episode(PICK, **fixed), expected)


def test_a_statement_takes_precedence(files: tuple[Path, Path]) -> None:
    model, written = files
    edited = written.with_name("edited.yaml")
    text = re.sub(r"  open:\n    left: .*", "  open: {left: 0.03}", written.read_text())
    edited.write_text(re.sub(r"  gap: .*\n", "", text))
    config = RobotConfig(robot=str(edited), gripper={"controller": "joint_position"})
    found = find_gripper(load_model(model), config.gripper)
    assert (found.open, found.controller) == ({"left": 0.03}, "joint_position")
    assert found.gap == pytest.approx((0.0, 0.06), abs=2e-3)


def test_joints_can_be_named_by_a_string() -> None:
    assert EnvConfig(task="reach", gripper="a, b").gripper == {"joints": ["a", "b"]}


@pytest.mark.parametrize("id", [PICK, REACH])
def test_a_gripper_is_not_stated_for_a_robot_that_is_no_file(id: str) -> None:
    with pytest.raises(ParameterValueError, match=r"gripper is .* must be omitted for robot 'panda'"):
        gym.make(f"frobs_core:{id}", robot="panda", gripper="panda_finger_joint1")


BAD = {
    "unknown key": ("robot: a.urdf\ngriper: {}\n", r"robot\.yaml.*2.*no key 'griper'; did you mean 'gripper'\?"),
    "no robot": ("home: {a: 1.0}\n", "'robot' must be the path of a model file"),
    "not finite": ("gripper: {tcp: {pos: [0, 0, .nan]}}\n", "finite number"),
    "unknown part": ("gripper: {jonts: [left]}\n", "Did you mean 'joints'"),
    "unknown joint": ("gripper: {joints: [lft]}\n", "no actuated joint of 'r' is named 'lft'. Did you mean 'left'"),
    "unknown link": ("gripper: {palm: plam}\n", "no link of 'r' is named 'plam'. Did you mean 'palm'"),
    "joint of the arm": ("gripper: {joints: [left], open: {j1: 0.0}}\n", "j1"),
    "outside its limits": ("gripper: {joints: [left], open: {left: 0.05}}\n", r"inside its limits \[0, 0\.04\]"),
    "no motion": (
        "gripper: {joints: [left], open: {left: 0.04}, closed: {left: 0.04}}\n",
        r"gripper\.open\.left is 0\.04; it must be another position than that in gripper\.closed",
    ),
    "lever of the arm": ("gripper: {levers: {j1: 1.0}}\n", "no finger joint of 'r' is named 'j1'"),
    "no stroke": ("gripper: {joints: [left], gap: [0.02, 0.02]}\n", "a wider open gap"),
    "not behind the palm": ("gripper: {joints: [j1], palm: palm}\n", "joints behind the palm 'wrist'"),
}


@pytest.mark.parametrize(("text", "message"), BAD.values(), ids=BAD)
def test_a_bad_statement_is_one_clear_error(files: tuple[Path, Path], text: str, message: str) -> None:
    path = files[0].parent / "robot.yaml"
    path.write_text(text if "robot:" in text or "home" in text else f"robot: four.urdf\n{text}")
    with pytest.raises((ConfigurationError, PluginError), match=message):
        _read(path)


def _read(path: Path) -> None:
    config = RobotConfig(robot=str(path))
    find_gripper(config.describe().read_model(), config.gripper)


def test_a_gripper_that_is_too_narrow_can_be_stated(tmp_path: Path) -> None:
    path = tmp_path / "narrow.urdf"
    path.write_text(robot(arm(), two_fingers(stroke=0.004)))
    stated = {"joints": ["left"], "open": {"left": 0.004}, "closed": {"left": 0.0}, "gap": [0.0, 0.008]}
    found = find_gripper(load_model(path), {**stated, "tcp": {"pos": [0.0, 0.0, 0.08]}})
    assert (found.palm, found.arm[-1], found.tcp.pos) == ("wrist", "j6", (0.0, 0.0, 0.08))
    assert found.levers == {"left": pytest.approx(1.0)}
    assert set(found.pads) == {"finger_a", "finger_b"}


TOOLS = {
    "two fingers": (robot(arm(), two_fingers()), "palm"),
    "one jaw, as on an SO-101": (robot(arm(5), one_jaw()), "palm"),
    "a frame between the fingers": (
        robot(arm(), two_fingers(), link("grasp_frame"), joint("f", "fixed", "palm", "grasp_frame", "0 0 0.08")),
        "grasp_frame",
    ),
    "no gripper": (robot(arm()), "wrist"),
}


@pytest.mark.parametrize(("text", "tool"), TOOLS.values(), ids=TOOLS)
def test_a_finger_is_never_the_default_tool(tmp_path: Path, text: str, tool: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    assert default_tcp(load_model(path)) == tool


def test_a_gripper_is_attached_by_name_or_file(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot(arm()))
    (tmp_path / "hand.urdf").write_text(robot(link("root"), two_fingers(carrier="root")))
    (tmp_path / "robot.yaml").write_text(
        "robot: arm.urdf\nattach: {robot: hand.urdf, link: wrist, pos: [0, 0, 0.01]}\n"
    )
    named = RobotConfig(robot=str(tmp_path / "arm.urdf"), attach="two_finger_hand").describe()
    assert (named.groups["arm"][-1], named.end_effectors["gripper"].group) == ("j6", "gripper")
    for config in (
        RobotConfig(robot=str(tmp_path / "robot.yaml")),
        RobotConfig(robot="irb120", attach=f"{tmp_path}/hand.urdf@tool0"),
    ):
        found = fit_robots(PickAndPlace, {"robot": replace(config, gripper={"joints": ["gripper_left"]})}, fit=False)
        tool = found.robots["robot"].end_effectors["gripper"]
        assert (tool.group, tool.gap) == ("gripper", pytest.approx((0.0, 0.08), abs=2e-3))
        assert len(found.robots["robot"].groups["arm"]) == 6
    with pytest.raises(PluginError, match="no link of robot 'irb120' is named 'wrist'"):
        RobotConfig(robot="irb120", attach="two_finger_hand@wrist").describe()
    with pytest.raises(PluginError, match="no robot is named 'two_fingers'"):
        RobotConfig(robot="irb120", attach="two_fingers").describe()


def test_a_joint_name_cannot_add_settings_to_a_written_file(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot(arm()).replace('"j6"', '"j6&#10;base: floating"'))
    report = examine_robot(tmp_path / "arm.urdf", simulators=["mujoco"])
    text = robot_file_text(report, str(tmp_path / "arm.urdf"), {}, tmp_path / "robot.yaml")
    (tmp_path / "robot.yaml").write_text(text)
    assert "base: floating" in text
    assert RobotConfig(robot=str(tmp_path / "robot.yaml")).base is None


@pytest.mark.parametrize("names", ["left", "[left]"])
def test_a_robot_file_can_name_only_the_joints_of_the_gripper(tmp_path: Path, names: str) -> None:
    (tmp_path / "robot.yaml").write_text(f"robot: arm.urdf\ngripper: {names}\n")
    assert RobotConfig(robot=str(tmp_path / "robot.yaml")).gripper == {"joints": ["left"]}


def test_the_folder_of_an_attached_gripper_may_contain_an_at_sign(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot(arm()))
    (folder := tmp_path / "me@work").mkdir()
    (folder / "hand.urdf").write_text(robot(link("root"), two_fingers(carrier="root")))
    for attach in ("me@work/hand.urdf", "me@work/hand.urdf@l3"):
        (tmp_path / "robot.yaml").write_text(f"robot: arm.urdf\nattach: {attach}\n")
        for config in (
            RobotConfig(robot=str(tmp_path / "robot.yaml")),
            RobotConfig(robot=str(tmp_path / "arm.urdf"), attach=f"{tmp_path}/{attach}"),
        ):
            assert config.from_file
            (mount,) = [each for each in config.describe().read_model().joints if each.name == "gripper_mounted"]
            assert mount.parent == ("l3" if "l3" in attach else "wrist")


@pytest.mark.slow
def test_an_arm_with_an_attached_gripper_picks_and_places(tmp_path: Path) -> None:
    (tmp_path / "hand.urdf").write_text(robot(link("root"), two_fingers(carrier="root")))
    with made(f"frobs_core:{PICK}", num_envs=20, robot="irb120", attach=str(tmp_path / "hand.urdf")) as env:
        assert success_rate(env) >= 0.95

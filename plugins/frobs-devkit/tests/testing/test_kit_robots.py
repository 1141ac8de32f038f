"""Faults in a robot: a sound one with one thing broken."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.description import Bumper, DriveGains, EndEffector, Imu, Lidar, Robot
from frobs_core.models import JointLimits
from frobs_core.plugins.records import RobotRecord
from frobs_core.util.errors import FrobsError
from frobs_devkit.testing import check_robot, pytest_checks, run_checks, simulator
from frobs_devkit.testing.checks import CheckFailure, NotApplicable
from frobs_devkit.testing.simulator.robots import ROVER
from frobs_sim_mujoco.robot import MujocoRobot

LINK = """<link name="{name}"><inertial><origin xyz="0.1 0 0"/><mass value="{mass}"/>
<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{ixx}" iyz="0" izz="{izz}"/></inertial>
<collision><origin xyz="{x} 0 0"/><geometry><box size="0.1 0.05 0.05"/></geometry></collision></link>"""
JOINT = """<joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0.25 0 0.1"/><axis xyz="0 1 0"/>{limit}</joint>"""
LIMIT = '<limit lower="-2.9" upper="2.9" velocity="3" effort="50"/>'


def arm(
    folder: Path,
    *,
    mass: float = 1.0,
    ixx: float = 0.01,
    izz: float = 0.01,
    type: str = "revolute",
    limit: str = LIMIT,
) -> Robot:
    usual = {"mass": 1.0, "ixx": 0.01, "izz": 0.01}
    special = {"mass": mass, "ixx": ixx, "izz": izz}
    links = [LINK.format(name=f"link_{i}", x=0.1, **(special if i == 2 else usual)) for i in range(4)]
    joints = [
        JOINT.format(name=f"joint_{i}", type=type, parent=f"link_{i}", child=f"link_{i + 1}", limit=limit)
        for i in range(3)
    ]
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="arm">{"".join(links + joints)}</robot>')
    home = {"joint_0": -0.4, "joint_1": -0.2} if type != "fixed" else {}
    gains = DriveGains(stiffness=2000.0, damping=100.0)
    sensors = {"imu": Imu(frame="link_3"), "bumper": Bumper(frame="link_2")}
    return Robot(model=str(path), tcp="link_3", home=home, gains=gains, sensors=sensors)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return arm(tmp_path_factory.mktemp("sound"))


def run(robot: Robot, name: str) -> None:
    next(check for check in check_robot(robot) if check.name == name).run()


@pytest.mark.slow
def test_a_sound_robot_passes(sound: Robot) -> None:
    for result in run_checks(check_robot(sound)).results:
        assert result.status in ("passed", "not_applicable"), result


test_the_irb120_passes = pytest_checks(check_robot("irb120", ["mujoco"]), allow_inconclusive=False)

# The floor is nearer to the third joint than the lidar can tell, which turns with it.
BLIND = Lidar(frame="link_2", rays=8, range_min=2.0, range_max=5.0)

DESCRIPTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "home_outside": ("home_is_inside_limits", {"home": {"joint_0": 3.0}}),
    "home_of_no_joint": ("home_is_inside_limits", {"home": {"joint_9": 0.0}}),
    "tcp_does_not_exist": ("tcp_moves", {"tcp": "gripper"}),
    "home_in_the_floor": ("home_is_above_floor", {"home": {"joint_0": 1.0}}),
    "tcp_in_the_middle": ("tcp_moves", {"tcp": "link_1"}),
    "tcp_stands_still": ("tcp_moves", {"tcp": "link_0"}),
    "no_damping": ("gains_are_positive", {"gains": DriveGains(stiffness=300.0, damping={"joint_0": 30.0})}),
    "no_stiffness": ("gains_are_positive", {"gains": DriveGains(stiffness=0.0, damping=30.0)}),
    "gains_of_no_joint": ("gains_are_positive", {"gains": DriveGains(stiffness=300.0, damping={"elbow": 3.0})}),
    "soft": ("gains_suit_the_masses", {"gains": DriveGains(stiffness=40.0, damping=2.0)}),
    "creeping": ("gains_suit_the_masses", {"gains": DriveGains(stiffness=2000.0, damping=2000.0)}),
    "unknown_base": ("parts_exist", {"base": "flying"}),
    "a_joint_in_two_groups": (
        "groups_and_tools_are_valid",
        {"groups": {"arm": ("joint_0", "joint_1"), "wrist": ("joint_1", "joint_2")}},
    ),
    "controller_of_no_group": ("groups_and_tools_are_valid", {"default_controllers": {"arm": "joint_position"}}),
    "unknown_controller": ("groups_and_tools_are_valid", {"default_controllers": {"all": "joint_postion"}}),
    "tool_of_no_group": (
        "groups_and_tools_are_valid",
        {"end_effectors": {"hand": EndEffector(tcp="link_3", group="fingers")}},
    ),
    "tool_opens_in_degrees": (
        "groups_and_tools_are_valid",
        {"end_effectors": {"hand": EndEffector(tcp="link_3", open={"joint_2": 60.0}, closed={"joint_2": 0.0})}},
    ),
    "lidar_on_no_link": (
        "sensors_are_fixed",
        {"sensors": {"scan": Lidar(frame="mast", rays=8, angle_min=-1, angle_max=1, range_min=0.1, range_max=5)}},
    ),
    "bumper_on_no_link": ("sensors_are_fixed", {"sensors": {"bumper": Bumper(frame="link_0", links=("skirt",))}}),
    "no_sensor": ("sensors_are_fixed", {"sensors": {"scan": "lidar"}}),
    "blind_lidar": ("mujoco.sensors_read", {"sensors": {"scan": BLIND}}),
    "folded": ("mujoco.home_is_free", {"home": {"joint_0": 2.9, "joint_1": 2.9, "joint_2": 0.0}}),
    "weak_drives": ("mujoco.home_is_held", {"gains": DriveGains(stiffness=1e-3, damping=1e-3)}),
}


@pytest.mark.parametrize(("check", "change"), DESCRIPTIONS.values(), ids=DESCRIPTIONS)
def test_the_kit_catches_a_description(sound: Robot, check: str, change: dict[str, Any]) -> None:
    with pytest.raises(FrobsError):
        run(replace(sound, **change), check)


def test_a_tool_needs_no_joint_that_moves_its_tool_center_point(sound: Robot) -> None:
    tool = replace(sound, tcp="link_0", end_effectors={"fingers": EndEffector(tcp="link_0")})
    with pytest.raises(NotApplicable):
        run(tool, "tcp_moves")
    with pytest.raises(CheckFailure):
        run(replace(tool, end_effectors={}), "tcp_moves")


def test_a_tool_needs_no_joints(tmp_path: Path) -> None:
    cup = arm(tmp_path, type="fixed", limit="")
    with pytest.raises(NotApplicable):
        run(replace(cup, end_effectors={"cup": EndEffector(tcp="link_0")}), "model_has_joints")


MODELS: dict[str, tuple[str, dict[str, Any]]] = {
    "no_joint": ("model_has_joints", {"type": "fixed", "limit": ""}),
    "weak_motors": ("efforts_hold_home", {"limit": LIMIT.replace('effort="50"', 'effort="5"')}),
    "limits_upside_down": ("notes_are_none", {"limit": LIMIT.replace('upper="2.9"', 'upper="-2.95"')}),
    "limits_in_degrees": ("limits_are_in_radians", {"limit": LIMIT.replace("2.9", "165")}),
    "velocity_in_degrees": ("limits_are_in_radians", {"limit": LIMIT.replace('"3"', '"172"')}),
    "millimeters": ("limits_are_in_radians", {"type": "prismatic", "limit": LIMIT.replace("2.9", "290")}),
    "gram_square_millimeters": ("inertias_fit_sizes", {"izz": 1e7, "ixx": 0.9e7}),
    "squared_twice": ("inertias_fit_sizes", {"izz": 1e-8, "ixx": 1e-8}),
    "no_effort": ("notes_are_none", {"limit": LIMIT.replace('effort="50"', 'effort="0"')}),
    "impossible_inertia": ("notes_are_none", {"izz": 0.5}),
    "negative_mass": ("notes_are_none", {"mass": -1.0}),
}


@pytest.mark.parametrize(("check", "change"), MODELS.values(), ids=MODELS)
def test_the_kit_catches_a_model(tmp_path: Path, check: str, change: dict[str, Any]) -> None:
    with pytest.raises(FrobsError):
        run(arm(tmp_path, **change), check)


LINK_3 = LINK.format(name="link_3", mass=1.0, ixx=0.01, izz=0.01, x=0.1)
FIXED = """<joint name="{child}_mount" type="fixed"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0.2 0 0"/></joint>"""
FINGER = """<link name="finger_{name}"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
<joint name="{name}" type="prismatic"><parent link="link_3"/><child link="finger_{name}"/>
<origin xyz="0.25 {y} 0"/><axis xyz="0 1 0"/><limit lower="-0.06" upper="0.06" velocity="1" effort="50"/></joint>"""
KD = {"joint_0": 100.0, "joint_1": 100.0}
DEGREES = Lidar(frame="link_3", rays=8, angle_min=-90.0, angle_max=90.0, range_min=0.01, range_max=5.0)


def replaced(robot: Robot, old: str, new: str) -> Robot:
    """Return a robot with another text in its model file."""
    path = Path(robot.model)
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return robot


def added(robot: Robot, text: str) -> Robot:
    """Return a robot with more links and joints in its model file."""
    return replaced(robot, "</robot>", f"{text}</robot>")


def separate(tmp_path: Path, patch: pytest.MonkeyPatch, check: str) -> Robot:
    """Return a robot with a fault, or a sound one in a simulator with one, that only a check catches."""
    sound = arm(tmp_path)
    if check == "model_has_joints":
        floor = replace(arm(tmp_path, type="fixed", limit=""), base="wheeled")
        patch.setattr(MujocoRobot, "base_pose", (np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]])))  # it stands
        return floor
    if check == "mujoco.frames_agree":
        pose = MujocoRobot.frame_pose

        def off(self: Any, frame: str, joint_positions: Any = None) -> Any:
            pos, quat = pose(self, frame, joint_positions)
            return (pos + 1e-4, quat) if frame == "link_2" else (pos, quat)

        patch.setattr(MujocoRobot, "frame_pose", off)
    if check == "mujoco.home_is_held":
        velocities = MujocoRobot.joint_velocities.fget  # type: ignore[attr-defined]
        patch.setattr(MujocoRobot, "joint_velocities", property(lambda self: velocities(self) + 0.1))
    if check == "mujoco.joints_follow":
        command = MujocoRobot.command
        patch.setattr(MujocoRobot, "command", lambda self, values: command(self, values[..., ::-1]))
        return replace(sound, home={"joint_0": -0.3, "joint_2": -0.3})
    if check == "tcp_is_the_tool":
        return added(sound, '<link name="tool0"/>' + FIXED.format(parent="link_3", child="tool0"))
    if check == "moving_links_touch":
        return replaced(sound, LINK_3, LINK_3.replace("collision>", "visual>"))
    if check == "masses_fit_shapes":
        return replaced(sound, LINK_3, LINK_3.replace('<collision><origin xyz="0.1', '<collision><origin xyz="0.3'))
    if check == "fingers_close":
        fingers = "".join(FINGER.format(name=name, y=y) for name, y in (("left", 0.1), ("right", -0.1)))
        wide, narrow = {"left": 0.05, "right": -0.05}, {"left": 0.0, "right": 0.0}
        tool = EndEffector(tcp="link_3", group="hand", open=narrow, closed=wide)
        groups = {"arm": ("joint_0", "joint_1", "joint_2"), "hand": ("left", "right")}
        return replace(added(sound, fingers), groups=groups, end_effectors={"hand": tool})
    if check == "mujoco.wheels_drive_as_described":
        rover: Robot = plugins.get_record("robot", "kobuki").load()
        assert rover.differential_drive is not None
        return replace(rover, differential_drive=replace(rover.differential_drive, wheel_radius=0.07))
    changes: dict[str, dict[str, Any]] = {
        "lidars_look_around_once": {"sensors": {"scan": DEGREES}},
        "tcp_moves": {"tcp": "link_0"},
        "home_is_above_floor": {"home": {"joint_0": 1.0}, "sensors": {}},
        "gains_are_positive": {"gains": DriveGains(stiffness=300.0, damping={"joint_0": 30.0})},
        "gains_suit_the_masses": {"gains": DriveGains(stiffness=2000.0, damping={**KD, "joint_2": 1.0})},
        "parts_exist": {"base": "flying"},
        "groups_and_tools_are_valid": {"default_controllers": {"arm": "joint_position"}},
        "sensors_are_fixed": {"sensors": {"imu": Imu(frame="mast")}},
        "mujoco.sensors_read": {"sensors": {"scan": BLIND}},
        "mujoco.home_is_free": {"home": {"joint_0": -1.2, "joint_1": 2.4, "joint_2": 2.4}},
    }
    if check == "inertias_fit_sizes":
        return arm(tmp_path, ixx=1e-8, izz=1e-8)
    if check == "notes_are_none":
        return arm(tmp_path, izz=0.5)
    if check == "efforts_hold_home":
        return arm(tmp_path, limit=LIMIT.replace('effort="50"', 'effort="5"'))
    if check == "limits_are_in_radians":
        return arm(tmp_path, limit=LIMIT.replace("2.9", "165"))
    return replace(sound, **changes.get(check, {}))


WHEELED_FINGER = """<link name="finger"><inertial><mass value="0.1"/>
<inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
<joint name="grip" type="prismatic"><parent link="hull"/><child link="finger"/>
<origin xyz="0.2 0 0.1"/><axis xyz="0 1 0"/><limit lower="0" upper="0.05" velocity="1" effort="50"/></joint>"""


def test_a_wheeled_robot_may_have_a_finger(tmp_path: Path) -> None:
    path = tmp_path / "rover.urdf"
    path.write_text((Path(simulator.__file__).parent / "urdf" / "kit_rover.urdf").read_text())
    gains = DriveGains(
        stiffness={"left": 0.0, "right": 0.0, "grip": 400.0}, damping={"left": 1, "right": 1, "grip": 13}
    )
    rover = added(replace(ROVER, model=str(path), gains=gains), WHEELED_FINGER)
    run(rover, "mujoco.joints_follow")
    stuck = replace(rover, gains=replace(gains, stiffness={"left": 0.0, "right": 0.0, "grip": 1e-3}))
    with pytest.raises(CheckFailure, match="'grip'"):
        run(stuck, "mujoco.joints_follow")


def test_fingers_that_move_in_the_same_direction_never_close(tmp_path: Path) -> None:
    fingers = "".join(FINGER.format(name=name, y=y) for name, y in (("left", 0.1), ("right", -0.1)))
    tool = EndEffector(
        tcp="link_3", group="hand", open={"left": 0.05, "right": 0.05}, closed={"left": 0.0, "right": 0.0}
    )
    groups = {"arm": ("joint_0", "joint_1", "joint_2"), "hand": ("left", "right")}
    with pytest.raises(CheckFailure, match="move in the same direction"):
        run(replace(added(arm(tmp_path), fingers), groups=groups, end_effectors={"hand": tool}), "fingers_close")


def test_drives_that_are_too_weak_are_one_failure(tmp_path: Path) -> None:
    results = run_checks(check_robot(separate(tmp_path, pytest.MonkeyPatch(), "efforts_hold_home"), ["mujoco"])).results
    same = [each.name for each in results if each.message == "the check fails for the same reason as efforts_hold_home"]
    assert same == ["mujoco.home_is_held", "mujoco.joints_follow"]


def test_a_link_that_no_posture_lifts_may_be_in_the_floor(sound: Robot, tmp_path: Path) -> None:
    sunk = '<link name="foot"><collision><geometry><box size="0.2 0.2 0.4"/></geometry></collision></link>'
    run(added(arm(tmp_path), sunk + FIXED.format(parent="link_0", child="foot")), "home_is_above_floor")


def test_a_negligible_link_may_have_any_inertia(tmp_path: Path) -> None:
    marker = LINK.format(name="marker", mass=1e-6, ixx=1e-6, izz=1e-6, x=0.0).replace("0.1 0.05 0.05", "1e-3 1e-3 1e-3")
    run(added(arm(tmp_path), marker + FIXED.format(parent="link_3", child="marker")), "inertias_fit_sizes")


def test_a_joint_that_rests_against_its_limit_may_rebound(
    sound: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An arm of Piper's kind lies on two stops, and its joints rebound from them by less than a milliradian."""
    reads = iter(range(10**6))

    def rebounding(robot: Any) -> Any:
        return np.full((1, 3), 0.2 * (-1.0) ** next(reads))

    monkeypatch.setattr(MujocoRobot, "joint_velocities", property(rebounding))
    with pytest.raises(CheckFailure, match="joint velocities"):
        run(sound, "mujoco.home_is_held")
    resting = arm(tmp_path, limit=LIMIT.replace('lower="-2.9"', 'lower="-0.4"'))
    run(resting, "mujoco.home_is_held")


def test_an_entry_point_that_does_not_exist_is_one_failure() -> None:
    broken = RobotRecord(name="broken", summary="a robot", entry_point="frobs_core.util.errors:NO_SUCH_ROBOT")
    results = run_checks(check_robot(broken, ["mujoco"])).results
    assert [result.status for result in results] == ["failed", *["skipped"] * (len(results) - 1)]
    assert "NO_SUCH_ROBOT" in results[0].message


INSEPARABLE = {
    "limits_are_stated": "the reader of model files mends such limits and notes it; it guards other readers",
    "home_is_inside_limits": "no simulator builds a robot whose home is outside of its limits",
    "inertias_are_possible": "the reader of model files mends such inertias and notes it; it guards other readers",
    "end_effectors_attach": "faults of Robot.attach are no robot's: tests/planted_faults plants them",
}
SEPARATE = [check.name for check in check_robot("irb120", ["mujoco"]) if check.name not in INSEPARABLE]


@pytest.mark.slow
@pytest.mark.parametrize("check", SEPARATE)
def test_no_other_check_catches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, check: str) -> None:
    report = run_checks(check_robot(separate(tmp_path, monkeypatch, check), ["mujoco"]))
    assert [result.name for result in report.failed] == [check]


@pytest.mark.parametrize(
    ("check", "fields"),
    [
        ("limits_are_stated", {"limits": JointLimits(lower=1.0, upper=-1.0, velocity=3.0, effort=50.0)}),
        ("limits_are_stated", {"limits": JointLimits(lower=-1.0, upper=1.0, velocity=0.0, effort=50.0)}),
    ],
)
def test_the_kit_catches_what_another_reader_lets_pass(
    sound: Robot, monkeypatch: pytest.MonkeyPatch, check: str, fields: dict[str, Any]
) -> None:
    read = Robot.read_model

    def careless(robot: Robot) -> Any:
        model = read(robot)
        return replace(model, joints=tuple(replace(joint, **fields) for joint in model.joints))

    monkeypatch.setattr(Robot, "read_model", careless)
    with pytest.raises(FrobsError):
        run(sound, check)

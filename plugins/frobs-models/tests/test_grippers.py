"""Grippers are found in model files, whatever their links and joints are called."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
import pytest
from gripper_arms import arm, joint, link, one_jaw, robot, two_fingers

from frobs_core.description import Robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import (
    Mimic,
    RobotModel,
    default_gains,
    default_tcp,
    find_reader,
    gravity_efforts,
    home_positions,
    load_model,
)
from frobs_core.util.errors import ModelFileError, PluginError, UnsuitableRobotError
from frobs_core.util.rotations import matrix_from_quat
from frobs_models.bounds import lowest_points
from frobs_models.grippers.gripper import Gripper, find_gripper
from frobs_models.grippers.loops import without_loops


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], RobotModel]:
    """A function that reads the text of a URDF."""

    def read(text: str) -> RobotModel:
        path = tmp_path / "r.urdf"
        path.write_text(text)
        return load_model(path)

    return read


def axes(gripper: Gripper) -> tuple[list[float], list[float]]:
    """Return the direction in which the fingers close, and that in which they point."""
    turn = matrix_from_quat(np.array(gripper.tcp.quat_wxyz)).round(6)
    return np.abs(turn[:, 1]).tolist(), turn[:, 2].tolist()


@pytest.mark.parametrize("follow", [True, False], ids=["one drive", "two drives"])
def test_two_fingers_are_measured(read: Callable[[str], RobotModel], follow: bool) -> None:
    found = find_gripper(read(robot(arm(), two_fingers(follow=follow))))
    assert found.arm == ("j1", "j2", "j3", "j4", "j5", "j6")
    assert found.joints == (("left",) if follow else ("left", "right"))
    assert (found.palm, found.has_one_jaw, found.unused) == ("wrist", False, ())
    assert found.gap == pytest.approx((0.0, 0.08), abs=2e-3)
    assert found.open["left"] == pytest.approx(0.04)
    assert found.closed["left"] == pytest.approx(0.0, abs=1.1e-3)
    assert found.object_size == pytest.approx(0.04)
    assert found.levers["left"] == pytest.approx(1.0, rel=0.05)
    assert axes(found) == ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    x, y, z = found.tcp.pos
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert 0.065 < z < 0.085  # between the pads, which end at 0.09 m


@pytest.mark.parametrize("widest", [1.2, 2.2], ids=lambda widest: f"{widest} rad")
def test_one_jaw_closes_on_the_palm(read: Callable[[str], RobotModel], widest: float) -> None:
    found = find_gripper(read(robot(arm(5), one_jaw(widest))))  # a jaw that opens wide is behind the palm at the end
    assert found.has_one_jaw
    assert (found.arm, found.joints) == (("j1", "j2", "j3", "j4", "j5"), ("grip",))
    assert found.gap[1] > 0.03
    assert found.open["grip"] > found.closed["grip"]
    assert found.closed["grip"] < 0.3
    assert axes(found) == ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    assert found.tcp.pos[1] > -0.01  # on the side of the moving jaw


def test_names_mean_nothing(read: Callable[[str], RobotModel]) -> None:
    text = robot(arm(), two_fingers())
    names = dict.fromkeys(re.findall(r'(?:name|link|joint)="(\w+)"', text))
    mapping = {name: f"x{number}" for number, name in enumerate(names)}
    renamed = re.sub(r'(?<=")\w+(?=")', lambda match: mapping.get(match[0], match[0]), text)
    first, second = find_gripper(read(text)), find_gripper(read(renamed))
    assert second.joints == tuple(mapping[name] for name in first.joints)
    assert (second.tcp, second.gap) == (first.tcp, first.gap)


def test_a_marker_is_not_solid(read: Callable[[str], RobotModel]) -> None:
    """A box that is drawn at the tool center point, as in many files, would keep the fingers apart."""
    marker = link("marker", visual='<visual><geometry><box size="0.01 0.01 0.01"/></geometry></visual>')
    at = joint("marked", "fixed", "palm", "marker", "0 0 0.07")
    assert find_gripper(read(robot(arm(), two_fingers(), marker, at))).gap == pytest.approx((0.0, 0.08), abs=2e-3)


def test_a_part_that_only_turns_is_left_out(read: Callable[[str], RobotModel]) -> None:
    propeller = link("propeller", "0.01 0.01 0.01") + joint("turns", "continuous", "palm", "propeller", "0 0 0.02")
    found = find_gripper(read(robot(arm(), two_fingers(), propeller)))
    assert (found.joints, found.unused) == (("left",), ("turns",))


def test_an_arm_on_wheels_is_followed(read: Callable[[str], RobotModel]) -> None:
    wheels = "".join(
        link(name, "0.02 0.1 0.1") + joint(f"{name}_axle", "continuous", "base", name, f"{x} 0 0")
        for name, x in (("wheel_a", -0.1), ("wheel_b", 0.1))
    )
    assert find_gripper(read(robot(arm(), two_fingers(), wheels))).arm == ("j1", "j2", "j3", "j4", "j5", "j6")


SMALL = two_fingers(stroke=0.004)
PAN_TILT = (
    link("pan", "0.02 0.02 0.02")
    + link("tilt", "0.02 0.05 0.02; 0 0 0.03")
    + joint("pans", "revolute", "wrist", "pan", "0 0 0.03", "0 0 1", "-1 1")
    + joint("tilts", "revolute", "pan", "tilt", "0 0 0.02", "0 1 0", "-1 1")
)
REFUSED = {
    "no gripper": (arm(), "its last joint, 'j6'|move no finger"),
    "fingers that open by 8 mm": (arm() + SMALL, r"opens the parts that it moves from 0 to 8 mm; .* at least 15 mm"),
    "a camera that pans": (arm() + PAN_TILT, "its last joint, 'tilts', closes on no other part"),
    "legs": (
        link("base", "0.2 0.2 0.1")
        + "".join(
            link(f"leg{i}", "0.02 0.02 0.2; 0 0 -0.1") + joint(f"hip{i}", "revolute", "base", f"leg{i}", limits="-1 1")
            for i in range(4)
        ),
        "its root carries several moving parts",
    ),
}


@pytest.mark.parametrize(("parts", "reason"), REFUSED.values(), ids=REFUSED)
def test_other_robots_are_refused_with_the_reason(read: Callable[[str], RobotModel], parts: str, reason: str) -> None:
    with pytest.raises(UnsuitableRobotError, match=f"'r' has no gripper that FRobs recognizes: .*({reason})"):
        find_gripper(read(robot(parts)))


def test_the_description_has_groups_a_tool_and_drives_that_hold(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(robot(arm(), two_fingers()))
    described = find_reader(path).with_gripper(Robot(model=str(path), name="r", home={"j2": 0.3}))
    assert described.groups == {"arm": ("j1", "j2", "j3", "j4", "j5", "j6"), "gripper": ("left",)}
    tool = described.end_effector_of()
    assert tool is not None
    assert (tool.arm, tool.group, tool.tcp) == ("arm", "gripper", described.tcp)
    assert tool.gap == pytest.approx((0.0, 0.08), abs=2e-3)
    assert described.home == {"left": pytest.approx(0.04), "j2": 0.3}
    assert described.gains is not None
    assert described.gains.of("left") == pytest.approx((10_000.0, 300.0), rel=0.1)
    model = load_model(described.model)
    (limits,) = [each.limits for each in model.joints if each.name == "left"]
    assert limits.effort == pytest.approx(80.0, rel=0.05)  # 40 N at each of the two pads
    assert limits.velocity == pytest.approx(0.04 / 0.3, rel=0.05)
    assert described == find_reader(path).with_gripper(Robot(model=str(path), name="r", home={"j2": 0.3}))


@pytest.mark.parametrize("end", [two_fingers(), one_jaw()], ids=["two fingers", "one jaw"])
def test_the_file_of_a_described_gripper_can_be_described_again(tmp_path: Path, end: str) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(robot(arm(6), end))
    once = find_reader(path).with_gripper(Robot(model=str(path), name="r"))
    twice = find_reader(path).with_gripper(Robot(model=once.model, name="r"))
    poses = [each.read_model().frame_pose("frobs_tcp", np.zeros((1, 7))) for each in (once, twice)]
    assert poses[1][0] == pytest.approx(poses[0][0], abs=2e-3)  # [m]
    assert twice.end_effectors["gripper"].gap == pytest.approx(once.end_effectors["gripper"].gap, abs=2e-3)


def test_drives_carry_the_motors_of_the_file_and_an_object(tmp_path: Path) -> None:
    def described(text: str, ending: str) -> Robot:
        path = tmp_path / f"r{ending}"
        path.write_text(text)
        return find_reader(path).with_gripper(Robot(model=str(path), name="r"))

    plain, motors = (mjcf(SLIDES, TENDON).replace("<joint ", f'<joint armature="{each}" ') for each in (0, 0.2))
    first, second = (described(text, ".xml").gains for text in (plain, motors))
    assert first is not None
    assert second is not None
    assert second.of("j4")[0] > 5 * first.of("j4")[0]

    heavy = robot(arm(), two_fingers())
    light = re.sub(r'mass value="[^"]*"', 'mass value="1e-3"', heavy).replace(
        '"1e-3" iyy="1e-3" izz="1e-3"', '"1e-6" iyy="1e-6" izz="1e-6"'
    )
    assert not {*described(heavy, ".urdf").armature} & {"j1", "j2", "j3"}
    carried = described(light, ".urdf").armature["j2"]
    assert 0.1 * 0.5**2 < carried < 0.1 * 1.0**2  # that of a cube of 0.1 kg at the distance of the tool


def test_gravity_bends_no_joint_noticeably(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(robot(arm(), two_fingers()).replace('effort="60"', 'effort="6"'))
    robot_of_file = Robot(model=str(path), name="r")
    described, model = find_reader(path).with_gripper(robot_of_file), load_model(path)
    assert described.gains is not None
    level = home_positions(model, {"j2": 1.57})  # the arm is stretched forward
    weights = np.abs(gravity_efforts(model, level))
    usual = default_gains(model, home_positions(model, {}))
    sags = {name: weight / usual.of(name)[0] for name, weight in zip(model.joint_names, weights, strict=True)}
    assert max(sags.values()) > 0.05
    for name, weight in zip(model.joint_names, weights, strict=True):
        assert min(weight, 6.0) / described.gains.of(name)[0] < 0.05, name  # no stiffness makes up for weak drives


@pytest.mark.parametrize("name", ["../../../r", "left/r", "r" * 300])
def test_the_name_of_a_robot_does_not_choose_the_folder(tmp_path: Path, name: str) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(robot(arm(), two_fingers()))
    usual = find_reader(path).with_gripper(Robot(model=str(path), name="r")).model
    path.write_text(path.read_text().replace('name="r"', f'name="{name}"'))
    described = find_reader(path).with_gripper(Robot(model=str(path), name="r"))
    assert Path(described.model).parent == Path(usual).parent


def test_a_home_in_the_floor_is_replaced(tmp_path: Path) -> None:
    def described(**home: float) -> tuple[Robot, float]:
        found = find_reader(path).with_gripper(Robot(model=str(path), name="r", home=home))
        model = load_model(found.model)
        heights = lowest_points(model, home_positions(model, found.home), (1.0, 0.0, 0.0, 0.0))
        return found, min(heights.values())

    path = tmp_path / "r.urdf"
    text = robot(arm(), two_fingers())
    path.write_text(text)
    usual, height = described()
    assert set(usual.home) == {"left"}
    assert height > -1e-3
    folded = text.replace('<origin xyz="0 0 0.35"/>', '<origin xyz="0 0 0.35" rpy="0 3.14159 0"/>')
    path.write_text(folded.replace('<origin xyz="0 0 0.3"/>', '<origin xyz="0 0 0.5"/>'))
    assert described(j1=0.1)[1] < -0.1  # what is stated stays
    raised, height = described()
    assert set(raised.home) == {"left", "j1", "j2", "j3", "j4", "j5", "j6"}
    assert height >= 0.0


@pytest.mark.parametrize(
    ("tcp", "message"),
    {
        "base": r"no joint that moves the tool center point 'base'; choose .* tcp='wrist'",
        "wirst": "no link of 'r' is named 'wirst'. Did you mean 'wrist'",
    }.items(),
)
def test_a_tool_center_point_that_the_arm_does_not_move_is_refused(tmp_path: Path, tcp: str, message: str) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(robot(arm(), two_fingers()))
    with pytest.raises((UnsuitableRobotError, PluginError), match=message):
        find_reader(path).with_gripper(Robot(model=str(path), name="r", tcp=tcp))


def test_an_arm_without_a_gripper_names_a_keyword_that_takes_a_file(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(robot(arm()))
    (tmp_path / "hand.urdf").write_text(robot(link("root"), two_fingers(carrier="root")))
    reader = find_reader(tmp_path / "r.urdf")
    with pytest.raises(UnsuitableRobotError, match="its file: attach='GRIPPER'") as caught:
        reader.with_gripper(Robot(model=str(tmp_path / "r.urdf"), name="r"))
    assert "ARM+GRIPPER" not in str(caught.value)  # a path would be taken for the path of a single file


def test_an_arm_whose_joints_have_no_actuator_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.xml"
    path.write_text(moving_hand("", f"<actuator>{TENDON}"))
    with pytest.raises(UnsuitableRobotError, match="no actuator for a joint between its root and 'carrier'"):
        find_reader(path).with_gripper(Robot(model=str(path), name="r"))


def test_masses_that_only_mujoco_can_measure_are_not_dropped(tmp_path: Path) -> None:
    path = tmp_path / "r.xml"
    shape = '<geom type="box" size="0.05 0.05 0.1" shellinertia="true" pos="0 0 0.1"/>'
    path.write_text(moving_hand(shape, f'<actuator><position joint="turn"/>{TENDON}'))
    with pytest.raises(ModelFileError, match=r'mass of <body name="carrier">.* add an <inertial>'):
        find_reader(path).with_gripper(Robot(model=str(path), name="r"))


def moving_hand(shape: str, more: str) -> str:
    """Return an MJCF file with two fingers on a carrier that turns. The carrier has a shape."""
    hand = f'<body name="hand"><geom type="box" size="0.03 0.05 0.015" pos="0 0 0.015"/>{SLIDES}</body>'
    carrier = f'<body name="carrier"><joint name="turn" axis="0 1 0" range="-1 1"/>{shape}{hand}</body>'
    world = f'<worldbody><body name="root">{carrier}</body></worldbody>'
    return f'<mujoco><compiler angle="radian"/>{world}{more}</mujoco>'


def test_a_gripper_of_an_mjcf_file_is_attached(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot(arm()))
    hand = f'<body name="hand"><geom type="box" size="0.03 0.05 0.015" pos="0 0 0.015"/>{SLIDES}</body>'
    text = f'<mujoco><compiler angle="radian"/><worldbody>{hand}</worldbody><actuator>{TENDON}</mujoco>'
    (tmp_path / "hand.xml").write_text(text)
    config = RobotConfig(robot=str(tmp_path / "arm.urdf"), attach=str(tmp_path / "hand.xml"))
    found = find_gripper(config.describe().read_model())
    assert found.arm == ("j1", "j2", "j3", "j4", "j5", "j6")
    assert found.gap == pytest.approx((0.0, 0.08), abs=2e-3)


def test_materials_without_a_name_keep_their_colors_when_attached(tmp_path: Path) -> None:
    drawn = (
        '<visual><geometry><box size="0.1 0.1 0.1"/></geometry>'
        '<material name=""><color rgba="{} 0 0 1"/></material></visual>'
    )
    (tmp_path / "arm.urdf").write_text(robot(arm()))
    parts = link("a", visual=drawn.format(0.25)), link("b", visual=drawn.format(0.75)), joint("f", "fixed", "a", "b")
    (tmp_path / "hand.urdf").write_text(robot(*parts))
    hand = Robot(model=str(tmp_path / "hand.urdf"), name="hand")
    model = Robot(model=str(tmp_path / "arm.urdf"), name="arm").attach("wrist", hand).read_model()
    assert [visual.rgba for each in model.links for visual in each.visuals] == [
        (0.25, 0.0, 0.0, 1.0),
        (0.75, 0.0, 0.0, 1.0),
    ]


def both_arms(tmp_path: Path) -> Path:
    """Return the file of two arms on one base, each with a gripper."""
    halves = []
    for side in ("left", "right"):
        text = arm() + two_fingers()
        text = re.sub(r'(?<=(?:name|link)=")(?!base)(?=\w)|(?<=joint=")', f"{side}_", text)
        halves.append(text if side == "left" else re.sub(r'<link name="base">.*?</link>', "", text))
    path = tmp_path / "two.urdf"
    path.write_text(robot(*halves))
    return path


def test_one_of_several_grippers_can_be_chosen(tmp_path: Path) -> None:
    path = both_arms(tmp_path)
    reader, described = find_reader(path), Robot(model=str(path), name="two")
    message = "'left_left' on 'left_wrist', 'right_left' on 'right_wrist'. Choose a gripper by its joints "
    with pytest.raises(UnsuitableRobotError, match=re.escape(f"{message}(--gripper left_left")):
        reader.with_gripper(described)
    chosen = reader.describe_gripper(described, {"joints": ["right_left"]})
    assert (chosen["palm"], chosen["arm"][0], chosen["gap"][1]) == (
        "right_wrist",
        "right_j1",
        pytest.approx(0.08, abs=2e-3),
    )
    assert reader.describe_gripper(replace(described, tcp="right_palm"), {}) == chosen
    assert default_tcp(load_model(path)) in ("left_palm", "right_palm")


HINGES = "".join(
    f'<body name="l{i}" pos="0 0 {z}"><joint name="j{i}" axis="{axis}" range="-2 2"/>{box}'
    for i, (z, axis, box) in enumerate(
        [
            (0.15, "0 0 1", ""),
            (0.05, "0 1 0", '<geom type="box" size="0.02 0.02 0.15" pos="0 0 0.17"/>'),
            (0.35, "0 1 0", '<geom type="box" size="0.02 0.02 0.13" pos="0 0 0.15"/>'),
            (0.3, "0 1 0", '<geom type="box" size="0.03 0.05 0.015" pos="0 0 0.015"/>'),
        ],
        start=1,
    )
)
"""The opening tags of an arm with four axes, which ends in a palm."""


def mjcf(fingers: str, rest: str) -> str:
    """Return the text of an MJCF file: an arm with fingers, and the sections behind the world."""
    base = '<body name="base"><geom type="box" size="0.05 0.05 0.05" pos="0 0 0.05"/>'
    drives = "".join(f'<position joint="j{i}" kp="100" forcerange="-50 50"/>' for i in range(1, 5))
    world = f"<worldbody>{base}{HINGES}{fingers}{'</body>' * 5}</worldbody>"
    return f'<mujoco><compiler angle="radian"/>{world}<actuator>{drives}{rest}</mujoco>'


SLIDES = "".join(
    f'<body name="{name}" pos="0 0 0.03"><joint name="{name}" type="slide" axis="0 {side} 0" range="0 0.04"/>'
    f'<geom type="box" size="0.01 0.005 0.03" pos="0 {0.005 * side} 0.03"/></body>'
    for name, side in (("left", 1), ("right", -1))
)
TENDON = (
    '<position tendon="both" kp="50"/></actuator><tendon><fixed name="both"><joint joint="left" coef="0.5"/>'
    '<joint joint="right" coef="0.5"/></fixed></tendon><equality><joint joint1="right" joint2="left"/></equality>'
)


def parallelogram(name: str, side: int) -> str:
    """Return a finger on two parallel bars of 6 cm: the outer bar is driven, and ``<connect>`` closes the linkage."""
    bar = '<body name="{0}" pos="0 {1} 0.03"><joint name="{0}" axis="{2} 0 0" range="0 0.8"/>'
    pad = f'<geom type="box" size="0.01 0.004 0.03" pos="0 {-0.021 * side} 0.03"/>'
    finger = f'<body name="{name}_finger" pos="0 0 0.06"><joint name="{name}_turn" axis="{side} 0 0"/>{pad}</body>'
    outer = bar.format(name, 0.025 * side, -side)
    return f"{outer}{finger}</body>{bar.format(f'{name}_inner', 0.015 * side, -side)}</body>"


PINS = "".join(
    f'<connect body1="{name}_finger" body2="{name}_inner" anchor="0 {-0.01 * side} 0"/>'
    for name, side in (("left", 1), ("right", -1))
)
LINKAGE = f'<position joint="left" kp="50"/></actuator><equality>{PINS}<joint joint1="right" joint2="left"/></equality>'


@pytest.mark.parametrize(
    ("fingers", "rest", "gap"),
    [(SLIDES, TENDON, 0.08), (parallelogram("left", 1) + parallelogram("right", -1), LINKAGE, 0.086)],
    ids=["a tendon", "linkages"],
)
def test_coupled_fingers_of_an_mjcf_file(tmp_path: Path, fingers: str, rest: str, gap: float) -> None:
    path = tmp_path / "r.xml"
    path.write_text(mjcf(fingers, rest))
    found = find_gripper(load_model(path))
    assert (found.arm, found.joints) == (("j1", "j2", "j3", "j4"), ("left",))
    assert found.gap == pytest.approx((0.0, gap), abs=2e-3)
    described = find_reader(path).with_gripper(Robot(model=str(path), name="r"))
    written = load_model(described.model)
    assert written.format == "urdf"
    assert "no-cap" not in [note.rule for note in written.notes]  # an MJCF file cannot state velocity limits
    assert {each.limits.velocity for each in written.actuated_joints[:4]} == {math.inf}
    assert written.joint_names == ("j1", "j2", "j3", "j4", "left")
    positions = np.full((1, 5), 0.3)
    for name in ("l4", "left", "right"):
        for actual, expected in zip(
            written.frame_pose(name, positions), load_model(path).frame_pose(name, positions), strict=True
        ):
            np.testing.assert_allclose(actual, expected, atol=1e-9)


def test_a_finger_that_a_linkage_carries_keeps_its_direction(tmp_path: Path) -> None:
    path = tmp_path / "r.xml"
    path.write_text(mjcf(parallelogram("left", 1) + parallelogram("right", -1), LINKAGE))
    model = without_loops(load_model(path))
    assert model.passive_joints == ()
    mimics = {joint.name: joint.mimic for joint in model.joints if joint.mimic}
    assert mimics["left_turn"] == Mimic("left", pytest.approx(1.0), pytest.approx(0.0, abs=1e-9))
    assert set(mimics) == {"left_turn", "left_inner", "right", "right_turn", "right_inner"}


def test_carriages_that_pass_each_other_are_no_pads(read: Callable[[str], RobotModel]) -> None:
    """The carriages of the fingers of an AR4 overlap behind the pads, which are shorter than 3 cm."""
    fingers = two_fingers(stroke=0.014)
    for side in ("0.005", "-0.005"):
        short, carriage = (
            f'<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'
            for xyz, size in ((f"0 {side} 0.02", "0.02 0.01 0.02"), ("0 0 0.005", "0.02 0.04 0.01"))
        )
        finger = (
            f'<collision><origin xyz="0 {side} 0.03"/><geometry><box size="0.02 0.01 0.06"/></geometry></collision>'
        )
        assert finger in fingers
        fingers = fingers.replace(finger, short + carriage)
    assert find_gripper(read(robot(arm(), fingers))).gap == pytest.approx((0.0, 0.028), abs=2e-3)


def test_two_arms_are_refused_with_their_grippers(read: Callable[[str], RobotModel]) -> None:
    def renamed(text: str, side: str) -> str:
        return re.sub(r'(name|link|joint)="(?!base)(\w+)"', rf'\1="{side}_\2"', text)

    base, rest = link("base", "0.1 0.1 0.1; 0 0 0.05", mass=5.0), arm().partition("</link>")[2] + two_fingers()
    reason = (
        r"has several arms or other chains; the joints of its grippers are 'a_left' on 'a_wrist', 'b_left' on 'b_wrist'"
    )
    with pytest.raises(UnsuitableRobotError, match=reason):
        find_gripper(read(robot(base, renamed(rest, "a"), renamed(rest, "b"))))


def test_fingers_without_limits_are_refused_with_their_joints(read: Callable[[str], RobotModel]) -> None:
    fingers = re.sub(r"<limit[^>]*/>", "", two_fingers())
    with pytest.raises(UnsuitableRobotError, match="left has no limits"):
        find_gripper(read(robot(arm(), fingers)))


PUBLIC = {
    "pybullet_data/franka_panda/panda.urdf": (7, 0.08),
    "pybullet_data/xarm/xarm6_with_gripper.urdf": (6, 0.089),
    "pybullet_data/xarm/xarm6_robot.urdf": None,
    "pybullet_data/kuka_iiwa/model.urdf": None,
    "example-robot-data/panda_description/urdf/panda.urdf": (7, 0.08),
    "example-robot-data/so_arm_description/urdf/so100.urdf": (5, 0.059),
    "example-robot-data/so_arm_description/urdf/so101.urdf": (5, 0.059),
    "example-robot-data/z1_description/urdf/z1.urdf": (6, 0.066),
    "example-robot-data/ur_description/urdf/ur5_gripper.urdf": None,
    "example-robot-data/xarm_description/urdf/xarm7.urdf": None,
    "example-robot-data/tiago_description/robots/tiago_no_hand.urdf": None,
}
"""Axes and open gap [m] of the arms in public packages, or None without a gripper."""


@pytest.mark.parametrize(("name", "expected"), PUBLIC.items(), ids=PUBLIC)
@pytest.mark.filterwarnings("ignore:.*a visual is not drawn")
def test_public_arms(name: str, expected: tuple[int, float] | None) -> None:
    package, _, inside = name.partition("/")
    try:
        within = "pybullet_data" if package == "pybullet_data" else f"cmeel.prefix/share/{package}/robots"
        folder = Path(str(distribution(package.replace("pybullet_data", "pybullet")).locate_file(within)))
    except PackageNotFoundError:
        pytest.skip(f"needs {package}")
    model = load_model(folder / inside)
    if expected is None:
        with pytest.raises(UnsuitableRobotError, match="has no gripper that FRobs recognizes"):
            find_gripper(model)
        return
    found = find_gripper(model)
    assert (len(found.arm), found.gap[1]) == (expected[0], pytest.approx(expected[1], abs=2e-3))


def test_a_visual_whose_mesh_is_missing_is_not_drawn_with_a_warning(tmp_path: Path) -> None:
    visual = '<visual><geometry><mesh filename="no.stl"/></geometry></visual>'
    path = tmp_path / "r.urdf"
    path.write_text(robot(link("a", "0.1 0.1 0.1", visual=visual)))
    with pytest.warns(UserWarning, match=r"r\.urdf: <link name=\"a\">: a visual is not drawn, .*no\.stl"):
        model = load_model(path)
    assert not model.links[0].visuals
    assert [note.rule for note in model.notes] == ["missing-visual"]

"""Errors about arms and areas: each names the constraint and a value with which the expert succeeds."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from expert_runs import made, success_rate
from gripper_arms import arm, robot, two_fingers

from frobs_core.description import Robot
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import find_reader, load_model
from frobs_core.util.errors import ConfigurationError, UnsuitableRobotError
from frobs_core.util.rotations import matrix_from_quat
from frobs_tasks_manipulation import fit as fitting
from frobs_tasks_manipulation.posture import ToolKinematics

PANDA = "frobs_core:frobs/Panda{}-v0"


def advised(message: str) -> dict[str, Any]:
    """Return the keywords that an error suggests."""
    (call,) = re.findall(r"choose (.*)\.$", message)
    node: Any = ast.parse(f"f({call})", mode="eval").body
    return {each.arg: ast.literal_eval(each.value) for each in node.keywords}


REFUSED = {
    "reach": ("Lift", {"center": [1.5, 0.0]}, r"the place is 1\.5. m from the base, and the reach at this height is"),
    "limit of a joint": ("Lift", {"center": [0.1, 0.0]}, "joint 'panda_joint6' would have to move to"),
    "area": ("Lift", {"area": 0.9}, r"cannot reach \(0\.95, -0\.45, 0\.02\) m .* pointing down"),
    "height of the start": (
        "Lift",
        {"start_height": 1.1},
        "it can get there, but not point down; choose start_height=",
    ),
    "height of the goals": ("PickAndPlace", {"highest": 0.9}, "not point down; choose highest="),
    "box of the controller": ("Lift", {"center": [0.5, 0.3]}, "its controller, which limits the tool to the box"),
    "stroke": ("Lift", {"size": 0.09}, "opens its gripper by 80 mm, too little for objects of 90 mm"),
    "tolerance": ("Push", {"tolerance": 0.4}, r"area is 0\.3; it must be above 0\.4 m, the tolerance"),
    "two cubes": ("Stack", {"area": 0.05}, r"area is 0\.05; it must be above 0\.06 m"),
    "peg and block": ("PegInsertion", {"area": 0.05}, r"area is 0\.05; it must be above 0\.09 m"),
    "handle": ("OpenDrawer", {"center": [1.2, 0.0]}, "and the reach at this height is"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("task", "keywords", "reason"), REFUSED.values(), ids=REFUSED)
def test_an_error_names_the_constraint_and_a_value_that_works(
    task: str, keywords: Mapping[str, Any], reason: str
) -> None:
    with pytest.raises(ConfigurationError, match=reason) as caught, made(PANDA.format(task), num_envs=1, **keywords):
        pass
    with made(PANDA.format(task), num_envs=10, **{**keywords, **advised(str(caught.value))}) as env:
        assert success_rate(env) >= 0.5


def test_an_object_that_the_gripper_cannot_hold_is_refused() -> None:
    with pytest.raises(UnsuitableRobotError, match=r"opens its gripper by 80 mm, too little for objects of 76 mm") as e:
        RobotEnv(task="lift", robot="panda", controller="tcp_delta_pose", size=0.076)
    assert advised(str(e.value)) == {"size": 0.036}


def file(folder: Path, *parts: str) -> str:
    path = folder / "arm.urdf"
    path.write_text(robot(*parts))
    return str(path)


NO_AREA = {
    "limit of a joint": (
        arm().replace('lower="-2.6" upper="2.6"', 'lower="-0.6" upper="0.6"'),
        r"joint '(\w+)' is limited to \[.*?\]; \[(\S+), (\S+)\] would work",
    ),
    "base": (
        arm().replace('"0.1 0.1 0.1"', '"1.1 1.1 0.1"'),
        r"the base extends to (0\.55) m in front, where the tool would work; for .*, it must end at (\S+) m",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("parts", "reason"), NO_AREA.values(), ids=NO_AREA)
def test_an_arm_without_a_working_area_needs_a_change_that_the_error_states(
    tmp_path: Path, parts: str, reason: str
) -> None:
    keywords: dict[str, Any] = {"num_envs": 10, "robot": file(tmp_path, parts, two_fingers())}
    with (
        pytest.raises(UnsuitableRobotError, match=f"'arm' has no working area: .*{reason}") as caught,
        made("frobs_core:frobs/PickAndPlace-v0", **keywords),
    ):
        pass
    found = re.findall(reason, str(caught.value))
    for values in found:
        if len(values) == 3:
            name, low, high = values
            pattern = rf'(name="{name}".*?)lower="[^"]*" upper="[^"]*"'
            parts = re.sub(pattern, rf'\1lower="{low}" upper="{high}"', parts)
        else:
            parts = parts.replace('"1.1 1.1 0.1"', f'"{2 * float(values[1])} {2 * float(values[1])} 0.1"')
    keywords["robot"] = file(tmp_path, parts, two_fingers())
    with made("frobs_core:frobs/PickAndPlace-v0", **keywords) as env:
        assert success_rate(env) >= 0.5


def test_an_arm_with_three_axes_cannot_point_down(tmp_path: Path) -> None:
    parts = arm(4).replace('type="revolute"><parent link="l3"/>', 'type="fixed"><parent link="l3"/>')
    with (
        pytest.raises(UnsuitableRobotError, match=r"no working area: .*with 3 axes; four axes would work"),
        made("frobs_core:frobs/PickAndPlace-v0", num_envs=1, robot=file(tmp_path, parts, two_fingers())),
    ):
        pass


# -- Another inverse kinematics agrees --


def independent(path: str, frame: str, joints: tuple[str, ...]) -> Any:
    """Return a function that finds the least errors [m, rad] of a tool at a pose with Pinocchio and SciPy."""
    pinocchio = pytest.importorskip("pinocchio", exc_type=ImportError)
    optimize = pytest.importorskip("scipy.optimize")
    model = pinocchio.buildModelFromXML(load_model(path).xml)
    data, tool = model.createData(), model.getFrameId(frame)
    columns = [model.joints[model.getJointId(name)].idx_q for name in joints]
    low, high = model.lowerPositionLimit[columns], model.upperPositionLimit[columns]

    def errors(posture: Any, pos: Any, turn: Any) -> Any:
        q = pinocchio.neutral(model)
        q[columns] = posture
        pinocchio.framesForwardKinematics(model, data, q)
        at = data.oMf[tool]
        return np.concatenate([at.translation - pos, pinocchio.log3(turn @ at.rotation.T)])

    def least(pos: Any, quat_wxyz: Any, radial: bool, starts: int = 30) -> tuple[float, float]:
        turn, best = matrix_from_quat(np.array(quat_wxyz)), (np.inf, np.inf)
        weights = np.array([10.0, 10.0, 10.0, 1.0, 1.0, 0.0 if radial else 1.0])
        for start in np.random.default_rng(0).uniform(low, high, (starts, len(low))):
            found = optimize.least_squares(lambda p: weights * errors(p, pos, turn), start, bounds=(low, high))
            error = np.abs(weights * errors(found.x, pos, turn))
            best = min(best, (float(error[:3].max()) / 10.0, float(error[3:].max())), key=sum)
            if best < (0.006, 0.06) and best[1] < 0.06:
                break
        return best

    return least


@pytest.mark.slow
@pytest.mark.needs("pinocchio")
@pytest.mark.parametrize("axes", [6, 5, 4])
def test_another_inverse_kinematics_agrees(tmp_path: Path, axes: int) -> None:
    path = file(tmp_path, arm(axes), two_fingers())
    described = find_reader(path).with_gripper(Robot(model=path, name="arm"))
    model = load_model(described.model)
    found = fitting.fit(described, model)
    kinematics = fitting.kinematics(described, model)
    least = independent(described.model, kinematics.frame, kinematics.joints)
    half = found.side / 2
    grid = [
        (x, y, z) for x in (-half, 0, half) for y in (-half, 0, half) for z in (0, 0.35 * found.highest, found.highest)
    ]
    for point in np.array([*found.center, found.size / 2]) + grid:
        near, turned = least(point, kinematics.orientation(point[None], found.yaw)[0], found.radial)
        assert near < 0.006, point
        assert turned < 0.06, point
    outside = 0
    for point in np.random.default_rng(1).uniform([0.1, -0.6, 0.02], [1.1, 0.6, 1.0], (25, 3)):
        quat = kinematics.orientation(point[None], found.yaw)[0]
        if kinematics.find(point, quat, near=(0.006, 0.06), floor=False) is None:
            near, turned = least(point, quat, found.radial)
            assert near >= 0.006 or turned >= 0.06, point
            outside += 1
    assert outside >= 5


def test_the_posture_of_a_start_does_not_depend_on_joints_that_move_no_tool() -> None:
    with made(PANDA.format("Lift"), num_envs=1) as env:
        arm_of_env = ToolKinematics.of(env.robot, False)
        pos, quat = (each[0] for each in env.robot.frame_pose("tcp"))
        found = arm_of_env.find(pos, quat)
        assert found is not None
        assert found[-2:] == pytest.approx(env.robot.home[0, -2:])

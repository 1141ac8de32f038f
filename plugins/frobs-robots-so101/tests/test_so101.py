from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from expert_runs import made, success_rate

from frobs_core import plugins
from frobs_core.models import RobotModel, home_positions, load_model
from frobs_core.models.defaults import composite_inertia
from frobs_core.util.rotations import quat_conjugate, quat_difference, quat_multiply, quat_rotate
from frobs_devkit.doctor.robot import examine_robot
from frobs_devkit.testing import check_plugin, check_robot, pytest_checks
from frobs_models import find_gripper
from frobs_robots_so101.so101 import SO101

# Simulation/SO101/so101_new_calib.urdf, and .xml for the effort, of github.com/TheRobotStudio/SO-ARM100 at fda892cb
LIMITS = {  # lower [rad], upper [rad], velocity [rad/s], effort [N·m]
    "shoulder_pan": (-1.91986, 1.91986, 10.0, 3.35),
    "shoulder_lift": (-1.74533, 1.74533, 10.0, 3.35),
    "elbow_flex": (-1.69, 1.69, 10.0, 3.35),
    "wrist_flex": (-1.65806, 1.65806, 10.0, 3.35),
    "wrist_roll": (-2.74385, 2.84121, 10.0, 3.35),
    "gripper": (-0.174533, 1.74533, 10.0, 3.35),
}
POSTURES = [  # [rad] in the order of LIMITS, drawn uniformly inside the limits
    (0.526, -0.804, -1.552, -1.603, 1.798, 1.578),
    (0.409, 0.801, 0.147, 1.443, 1.813, -0.169),
    (1.372, -1.628, 0.776, -1.076, 2.077, 0.865),
    (-0.769, -0.27, -1.594, -1.246, 1.002, 1.068),
    (0.443, -0.406, 1.681, 1.595, 1.085, 1.074),
    (0.724, -0.388, -1.233, 0.734, 0.19, 0.421),
]
# Position [m] and orientation (w, x, y, z) of links in each posture, in the frame of the base. Made by
# model = load_model("so101_new_calib.urdf"); order = [list(LIMITS).index(name) for name in model.joint_names]
# np.hstack(model.frame_pose(link, np.array(POSTURES)[:, order])).round(5)
POSES = {
    "gripper_frame_link": [
        (-0.171, 0.11267, 0.18936, -0.15439, -0.53397, 0.76129, 0.33388),
        (0.12596, -0.04636, -0.04157, -0.18557, -0.57499, 0.71444, 0.35288),
        (0.02039, 0.05525, 0.39096, 0.12695, -0.05726, 0.16818, 0.97587),
        (-0.08267, -0.12698, 0.36962, 0.71514, 0.52787, -0.45339, -0.06609),
        (-0.05316, 0.0358, 0.06453, -0.44681, -0.23279, 0.76154, 0.4077),
        (0.11904, -0.07293, 0.48437, 0.85531, 0.0963, 0.32114, -0.39502),
    ],
    "moving_jaw_so101_v1_link": [
        (-0.12955, 0.11668, 0.26008, 0.02246, 0.89103, -0.20662, 0.40358),
        (0.17055, -0.03962, 0.027, 0.27799, 0.70663, 0.59957, 0.2528),
        (0.04748, 0.00588, 0.33125, -0.57313, 0.71382, -0.38381, -0.12112),
        (-0.05261, -0.05068, 0.3665, 0.30313, 0.76355, 0.56961, 0.02541),
        (0.0259, 0.03578, 0.08656, 0.2924, 0.95624, -0.01004, -0.00204),
        (0.08417, -0.01168, 0.44233, -0.38308, 0.19168, 0.64712, -0.63067),
    ],
}

test_plugin = pytest_checks(check_plugin("robots_so101"))
test_robot = pytest_checks(check_robot("so101", simulators=["mujoco"]))


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_model(SO101.model)


def test_the_record_leads_to_the_robot() -> None:
    assert plugins.get_record("robot", "so101").load() is SO101


def test_joints_and_limits_are_the_makers(model: RobotModel) -> None:
    found = {each.name: each.limits for each in model.actuated_joints}
    assert {name: (each.lower, each.upper, each.velocity, each.effort) for name, each in found.items()} == LIMITS


def test_masses_are_the_makers(model: RobotModel) -> None:
    masses = [link.inertial.mass for link in model.links if link.inertial]
    assert masses == [0.147, 0.100006, 0.103, 0.104, 0.079, 0.087, 0.012]


@pytest.mark.parametrize("link", POSES)
def test_links_are_where_the_makers_file_puts_them(model: RobotModel, link: str) -> None:
    pos, quat = model.frame_pose(link, np.array(POSTURES))
    expected = np.array(POSES[link])
    assert np.linalg.norm(pos - expected[:, :3], axis=1).max() < 1e-3  # [m]
    assert np.linalg.norm(quat_difference(quat, expected[:, 3:]), axis=1).max() < math.radians(0.5)


def test_the_gripper_is_the_one_that_is_found_in_the_file(model: RobotModel) -> None:
    found, stated = find_gripper(model), SO101.end_effectors["gripper"]
    assert (found.arm, found.joints) == (SO101.groups["arm"], SO101.groups["gripper"])
    assert (found.has_one_jaw, found.palm) == (stated.has_fixed_jaw, "gripper_link")
    assert found.gap == pytest.approx(stated.gap, abs=1e-3)
    assert found.open == pytest.approx(stated.open, abs=0.05)
    assert found.closed == pytest.approx(stated.closed)
    palm, tcp = (model.frame_pose(frame, np.zeros((1, 6))) for frame in ("gripper_link", "tcp"))
    local = quat_rotate(quat_conjugate(palm[1]), tcp[0] - palm[0])[0]
    assert local == pytest.approx(found.tcp.pos, abs=1e-3)  # [m]
    turned = quat_multiply(palm[1], np.array([found.tcp.quat_wxyz]))
    assert np.abs(quat_difference(turned, tcp[1])).max() < 1e-3  # [rad]


def test_no_link_touches_another_at_home_or_while_the_wrist_turns(model: RobotModel) -> None:
    engine = mujoco.MjModel.from_xml_string(model.xml)
    data, home = mujoco.MjData(engine), home_positions(model, SO101.home)
    for joint, name in enumerate(LIMITS):
        if name in ("shoulder_pan", "wrist_flex", "wrist_roll", "gripper"):  # the others fold the arm onto its base
            for value in np.linspace(*LIMITS[name][:2], 41):
                data.qpos[:] = home
                data.qpos[joint] = value
                mujoco.mj_forward(engine, data)
                assert not data.ncon, (name, value)


def test_drives_are_critically_damped_or_more_everywhere(model: RobotModel) -> None:
    assert SO101.gains is not None
    driven = replace(model, joints=tuple(replace(j, armature=SO101.armature.get(j.name, 0.0)) for j in model.joints))
    low, high = np.array(list(LIMITS.values()))[:, :2].T
    for q in np.random.default_rng(2).uniform(low, high, (50, 6)):
        for name, inertia in composite_inertia(driven, q).items():
            stiffness, damping = SO101.gains.of(name)
            assert damping / (2 * math.sqrt(stiffness * inertia)) > 0.99, name


def test_the_doctor_finds_nothing() -> None:
    assert examine_robot("so101", simulators=("mujoco",)).findings == ()


def test_xacro_arguments_are_taken() -> None:
    weak = load_model(SO101.model, xacro_args={"prefix": "left_", "effort": "1.62"})
    assert (weak.root, weak.joint_names[0]) == ("left_base_link", "left_shoulder_pan")
    assert {joint.limits.effort for joint in weak.actuated_joints} == {1.62}


def test_it_picks_and_places() -> None:
    with made("frobs_core:frobs/PickAndPlace-v0", num_envs=50, robot="so101") as env:
        assert success_rate(env) >= 0.98


@pytest.mark.slow
@pytest.mark.parametrize(("task", "rate"), [("Lift", 0.98), ("Stack", 0.95), ("Push", 0.75)])
def test_other_tasks_work_too(task: str, rate: float) -> None:
    with made(f"frobs_core:frobs/{task}-v0", num_envs=100, robot="so101") as env:
        assert success_rate(env) >= rate

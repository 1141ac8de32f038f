"""What touches is what touches in the engine."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("ompl")
pytest.importorskip("toppra")
pytest.importorskip("pinocchio", exc_type=ImportError)  # which needs libgomp1

import pinocchio as pin

from frobs_controllers_planning.kinematics import Kinematics
from frobs_controllers_planning.plan import Reason
from frobs_controllers_planning.planner import Planner
from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Contact, Placement, Scene
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import Box, Capsule, Cylinder, Mesh, Pose, Sphere, load_model
from frobs_core.util.rotations import quat_from_rpy
from frobs_sim_mujoco.simulation import MujocoSimulation

BODIES = {
    "box": Body(geometry=Box((0.2, 0.3, 0.4)), pose=Pose((0.45, 0.45, 0.3), tuple(quat_from_rpy([0.3, 0.2, 0.5])))),
    "ball": Body(geometry=Sphere(0.15), pose=Pose((-0.4, 0.2, 0.5))),
    "rod": Body(geometry=Cylinder(0.1, 0.8), pose=Pose((0.0, -0.5, 0.4))),
    "bar": Body(geometry=Capsule(0.1, 0.4), pose=Pose((0.4, -0.4, 0.6), tuple(quat_from_rpy([1.0, 0.0, 0.0])))),
    "ghost": Body(geometry=Box((0.3, 0.3, 0.3)), pose=Pose((0.3, 0.0, 0.3)), collides=False),
}
SIDES = ("robot", "floor", "box", "ball", "rod", "bar")

PRONGS = """<robot name="prongs">
<link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<link name="beam"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="left"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.2 0.02 0.02"/></geometry></collision></link>
<link name="right"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.2 0.02 0.02"/></geometry></collision></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="beam"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/></joint>
<joint name="open" type="prismatic"><parent link="beam"/><child link="left"/><origin xyz="0.1 0.05 0"/><axis xyz="0 1 0"/>
<limit lower="-0.2" upper="0.2" velocity="1" effort="10"/></joint>
<joint name="follow" type="prismatic"><parent link="beam"/><child link="right"/><origin xyz="0.1 -0.05 0"/><axis xyz="0 1 0"/>
<limit lower="-0.2" upper="0.2" velocity="1" effort="10"/><mimic joint="open" multiplier="-1"/></joint>
</robot>"""


@pytest.fixture
def prongs(tmp_path: Path):
    path = tmp_path / "prongs.urdf"
    path.write_text(PRONGS)
    return RobotConfig(robot=str(path)).describe()


def in_engine(description, scene, joint_positions):
    """Return where nothing touches in MuJoCo, (n,) bool."""
    placement = Placement(robot=description, model=load_model(description.model), command_mode=CommandMode.POSITION)
    n = len(joint_positions)
    with closing(MujocoSimulation({"robot": placement}, scene, num_envs=n, physics_timestep=1e-5)) as simulation:
        simulation.reset()
        simulation.robots["robot"].write_joint_state(joint_positions)
        simulation.robots["robot"].command(joint_positions)
        simulation.step(1)
        return ~np.stack([simulation.contact(name) for name in scene.contacts]).any(axis=0)


def test_the_arm_touches_what_it_touches_in_the_engine():
    scene = Scene(bodies=BODIES, contacts={side: Contact(first="robot", second=side) for side in SIDES})
    planner = Planner("irb120", scene, clearance=0.0)
    drawn = np.random.default_rng(0).uniform(planner.lower, planner.upper, (600, 6))
    expected = in_engine(RobotConfig(robot="irb120").describe(), scene, drawn)
    found = np.array([planner.is_free(q) for q in drawn])
    np.testing.assert_array_equal(found, expected)
    assert 0.2 < found.mean() < 0.9


def test_joints_that_follow_others_touch_what_they_touch_in_the_engine(prongs):
    scene = Scene(contacts={side: Contact(first="robot", second=side) for side in ("robot", "floor")})
    planner = Planner(prongs, scene, clearance=0.0)
    drawn = np.stack([np.zeros(50), np.linspace(-0.19, 0.19, 50)], axis=-1)
    found = np.array([planner.is_free(q) for q in drawn])
    np.testing.assert_array_equal(found, in_engine(prongs, scene, drawn))
    assert 0 < found.sum() < 50


@pytest.fixture
def hoop(tmp_path: Path):
    """A ring whose hole is wide enough for the arm's tool, as a mesh file."""
    import trimesh

    path = tmp_path / "hoop.stl"
    trimesh.creation.annulus(0.2, 0.26, 0.04, sections=16).export(path)
    return path


@pytest.mark.needs("coacd")
@pytest.mark.parametrize("decomposed", [False, True])
def test_a_mesh_touches_where_it_touches_in_the_engine(hoop, decomposed):
    pose = Pose((0.42, 0.0, 0.5), tuple(quat_from_rpy([0.0, 1.4, 0.2])))
    bodies = {"hoop": Body(geometry=Mesh(hoop, decomposed=decomposed), pose=pose)}
    scene = Scene(
        bodies=bodies, contacts={side: Contact(first="robot", second=side) for side in ("robot", "floor", "hoop")}
    )
    planner = Planner("irb120", scene, clearance=0.0)
    near = np.random.default_rng(0).uniform(-0.7, 0.7, (600, 6))
    drawn = np.clip(planner.home + near, planner.lower, planner.upper)
    found = np.array([planner.is_free(q) for q in drawn])
    np.testing.assert_array_equal(found, in_engine(RobotConfig(robot="irb120").describe(), scene, drawn))
    assert 0.05 < found.mean() < 0.95


@pytest.mark.needs("coacd")
@pytest.mark.parametrize("decomposed", [False, True])
def test_a_tool_goes_through_a_hoop_only_if_the_hoop_is_decomposed(hoop, decomposed):
    pose = Pose((0.42, 0.0, 0.63), tuple(quat_from_rpy([0.0, np.pi / 2, 0.0])))
    scene = Scene(bodies={"hoop": Body(geometry=Mesh(hoop, decomposed=decomposed), pose=pose)})
    planner = Planner("irb120", scene, clearance=0.005)
    before, behind = np.array([0.0, -0.6, 0.6, 0.0, 0.0, 0.0]), np.array([0.0, 0.3, -0.3, 0.0, 0.0, 0.0])
    assert planner.tool_pos(before)[0] < 0.4
    assert planner.tool_pos(behind)[0] > 0.44
    assert planner.plan(before, behind).reason is (Reason.PLANNED if decomposed else Reason.GOAL_IN_COLLISION)


def test_a_clearance_is_kept():
    scene = Scene(bodies={"ball": Body(geometry=Sphere(0.1), pose=Pose((0.54, 0.0, 0.43)))})
    near, far = Planner("irb120", scene, clearance=0.001), Planner("irb120", scene, clearance=0.1)
    assert near.is_free(near.home)
    assert near.plan(near.home, near.home + 0.01).success
    assert far.is_free(near.home) is False


def test_a_way_is_looked_at_closely_enough_to_meet_what_is_thin():
    sheet = Body(geometry=Box((0.4, 0.001, 0.6)), pose=Pose((0.45, 0.0, 0.45)))
    planner = Planner("irb120", Scene(bodies={"sheet": sheet}), clearance=0.005)
    left, right = np.array([0.5, 0.5, 0.2, 0.0, 0.8, 0.0]), np.array([-0.5, 0.5, 0.2, 0.0, 0.8, 0.0])
    assert len(planner.plan(left, right).path) > 2


def test_no_part_of_the_robot_moves_farther_than_its_reach_says(prongs):
    for description in (RobotConfig(robot="irb120").describe(), prongs):
        model = load_model(description.model)
        planner, kinematics = Planner(description), Kinematics(model)
        rng = np.random.default_rng(1)
        lower, upper = planner.lower, planner.upper
        for _ in range(50):
            q, step = rng.uniform(lower, upper), rng.uniform(-1e-3, 1e-3, len(lower))
            for link in model.links:
                before, after = kinematics.frame_pose(link.name, q), kinematics.frame_pose(link.name, q + step)
                for collision in link.collisions:
                    corner = np.array(collision.origin.pos)  # the shape's middle; its rim is bounded by its radius too
                    moved = np.linalg.norm(after.act(corner) - before.act(corner))
                    assert moved <= np.abs(step) @ planner._checker.reach + 1e-12


def test_kinematics_are_those_of_the_core(prongs):
    for description in (RobotConfig(robot="irb120").describe(), prongs):
        model = load_model(description.model)
        kinematics, q = Kinematics(model), np.linspace(0.05, 0.15, len(model.joint_names))
        for link in model.links:
            pose = kinematics.frame_pose(link.name, q)
            np.testing.assert_allclose(pose.translation, model.frame_pose(link.name, q[None])[0][0], atol=1e-12)
        tip = model.links[-1].name
        _, jacobian = kinematics.frame_jacobian(tip, q)
        for i in range(len(q)):
            h = np.eye(len(q))[i] * 1e-6
            ahead, behind = kinematics.frame_pose(tip, q + h), kinematics.frame_pose(tip, q - h)
            np.testing.assert_allclose(jacobian[:3, i], (ahead.translation - behind.translation) / 2e-6, atol=1e-6)
            turn = pin.log3(ahead.rotation @ behind.rotation.T) / 2e-6
            np.testing.assert_allclose(jacobian[3:, i], turn, atol=1e-6)

"""What Gazebo does is what MuJoCo does, closely, and Pinocchio, and the closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Body, Lidar, Placement, Robot, Scene
from frobs_core.models import Capsule, Cylinder, Pose, RobotModel, Sphere, load_model
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_rotate
from frobs_devkit.testing.simulator.robots import ROVER, model_of
from frobs_robots_abb.irb120 import IRB120
from frobs_sim_gazebo.installation import Installation
from frobs_sim_gazebo.simulation import GazeboSimulation
from frobs_sim_mujoco.simulation import MujocoSimulation

TIMESTEP = 0.002
MODEL = load_model(IRB120.model)


def build(cls: type[Simulation], robot: Robot, model: RobotModel = MODEL, scene: Scene | None = None) -> Simulation:
    placement = Placement(robot=robot, model=model, command_mode=CommandMode.POSITION)
    scene = scene or Scene(floor=False, cameras={})
    sim = cls({"robot": placement}, scene, num_envs=1, physics_timestep=TIMESTEP, num_threads=1)
    sim.reset()
    return sim


def step_response(cls: type[Simulation], robot: Robot, model: RobotModel, jump: float) -> Floats:
    """Return positions (steps, dof) while commands jump to and fro."""
    sim = build(cls, replace(robot, self_collision=False), model)
    arm = sim.robots["robot"]
    positions = np.zeros((100, arm.dof))
    signs = np.where(np.arange(arm.dof) % 2, 1.0, -1.0)
    for k in range(100):
        if k % 25 == 0:
            arm.command(arm.home + jump * signs * (1.0 if k % 50 == 0 else -1.0))
        sim.step(10)
        positions[k] = arm.joint_positions[0]
    sim.close()
    return positions


@pytest.mark.parametrize(("base", "effort"), [("fixed", np.inf), ("fixed", 30.0), ("floating", np.inf)])
def test_two_seconds_of_free_motion_are_mujocos_to_two_hundredths_of_a_radian(
    gazebo: Installation, base: str, effort: float
) -> None:
    limits = {"lower": -np.inf, "upper": np.inf, "effort": effort}
    joints = tuple(replace(joint, limits=replace(joint.limits, **limits)) for joint in MODEL.joints)
    model, robot = replace(MODEL, joints=joints), replace(IRB120, base=base)
    there, here = (step_response(cls, robot, model, 0.4) for cls in (MujocoSimulation, GazeboSimulation))
    assert np.ptp(here, axis=0).min() > 0.3
    assert np.abs(there - here).max() <= 0.02


def test_links_stay_where_the_joint_positions_put_them(gazebo: Installation) -> None:
    sim = build(GazeboSimulation, IRB120)
    assert isinstance(sim, GazeboSimulation)
    arm, bones = sim.robots["robot"], sim.layout.skeletons["robot"]
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(20):
        arm.command(arm.home + rng.uniform(-0.1, 0.1, (1, arm.dof)))
        sim.step(20)
        pos, quat, _ = bones.place(np.concatenate(arm.base_pose, axis=1), sim.positions)
        coms = pos[0] + quat_rotate(quat[0], sim.layout.coms)
        worst = max(worst, float(np.abs(sim.raw[0, :, :3] - coms).max()))
    sim.close()
    assert worst < 1e-4  # [m]


@pytest.mark.needs("pinocchio")
def test_frames_are_pinocchios(gazebo: Installation, tmp_path: Path) -> None:
    import pinocchio

    path = tmp_path / "irb120.urdf"
    path.write_text(MODEL.xml)
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    sim = build(GazeboSimulation, IRB120)
    arm = sim.robots["robot"]
    for seed in range(3):
        q = np.random.default_rng(seed).uniform(-1.0, 1.0, (1, arm.dof))
        arm.write_joint_state(q)
        pinocchio.forwardKinematics(model, data, q[0])
        pinocchio.updateFramePlacements(model, data)
        place = data.oMf[model.getFrameId(arm.tcp)]
        assert arm.frame_pose("tcp")[0][0] == pytest.approx(place.translation, abs=1e-9)
    sim.close()


def test_a_lidar_sees_what_mujocos_sees(gazebo: Installation) -> None:
    bodies = {
        "ball": Body(geometry=Sphere(0.3), pose=Pose((1.5, 0.2, 0.4))),
        "pillar": Body(geometry=Cylinder(0.2, 2.0), pose=Pose((-0.3, 1.2, 0.5))),
        "bollard": Body(geometry=Capsule(0.2, 0.6), pose=Pose((-1.0, -1.0, 0.4), (0.8, 0.6, 0.0, 0.0))),
    }
    lidar = Lidar(frame="base_link", rays=90, range_min=0.05, range_max=5.0, offset=(0.0, 0.0, 0.4))
    robot = replace(IRB120, sensors={"scan": lidar})
    found = []
    for cls in (MujocoSimulation, GazeboSimulation):
        sim = build(cls, robot, scene=Scene(bodies=bodies, cameras={}))
        found.append(sim.robots["robot"].lidar("scan")[0])
        sim.close()
    assert (found[1] < 4.0).sum() > 15
    assert found[1] == pytest.approx(found[0], abs=1e-5)


def test_a_motion_repeats_after_a_reset_and_in_another_server(gazebo: Installation) -> None:
    traces = []
    for _ in range(2):
        sim = build(GazeboSimulation, IRB120)
        for _ in range(2):
            sim.reset()
            arm = sim.robots["robot"]
            arm.command(arm.home + 0.5)
            sim.step(200)
            traces.append(arm.joint_positions[0].copy())
        sim.close()
    for trace in traces[1:]:
        assert trace == pytest.approx(traces[0], abs=1e-9)


def test_a_robot_on_its_wheels_leaves_the_solver_in_peace(gazebo: Installation) -> None:
    placement = Placement(
        robot=ROVER, model=model_of(ROVER.model), pose=Pose((0.0, 0.0, 0.051)), command_mode=CommandMode.VELOCITY
    )
    sim = GazeboSimulation({"robot": placement}, Scene(cameras={}), num_envs=1, physics_timestep=TIMESTEP)
    server, rover = sim.native[0], sim.robots["robot"]
    assert server is not None
    rover.command(np.array([[6.0, 3.0]]))
    sim.step(1000)
    assert "LCP" not in server.log()  # ODE's word for contacts that it could not solve for
    assert abs(rover.base_pose[0][0, 2] - 0.05) < 1e-3
    sim.close()

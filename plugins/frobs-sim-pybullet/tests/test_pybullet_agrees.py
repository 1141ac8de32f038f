"""What PyBullet does is what MuJoCo does, and Pinocchio, and the closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robots import place

from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Body, Placement, Robot, Scene
from frobs_core.models import Box, Capsule, Cylinder, Pose, RobotModel, Sphere, load_model
from frobs_core.util.arrays import Floats, Mask
from frobs_robots_abb.irb120 import IRB120
from frobs_sim_mujoco.simulation import MujocoSimulation
from frobs_sim_pybullet.simulation import PybulletSimulation

ENGINES = (MujocoSimulation, PybulletSimulation)
TIMESTEP = 0.002
_MODEL = load_model(IRB120.model)


def with_joints(model: RobotModel, **changes: Any) -> RobotModel:
    """Return a model whose joints have another effort limit, damping or friction, and no end to their range."""
    effort = changes.pop("effort", np.inf)
    limits = {"lower": -np.inf, "upper": np.inf, "effort": effort}
    joints = (replace(joint, limits=replace(joint.limits, **limits), **changes) for joint in model.joints)
    return replace(model, joints=tuple(joints))


def build(cls: type[Simulation], robot: Robot, model: RobotModel, **keywords: Any) -> Simulation:
    placement = Placement(
        robot=replace(robot, self_collision=False), model=model, command_mode=CommandMode.POSITION, **keywords
    )
    sim = cls(
        {"robot": placement}, Scene(floor=False, cameras={}), num_envs=1, physics_timestep=TIMESTEP, num_threads=1
    )
    sim.reset()
    return sim


def step_response(
    cls: type[Simulation], robot: Robot, model: RobotModel, jump: float, steps: int = 1000
) -> tuple[Floats, Mask]:
    """Return positions (steps, dof) and which joints are saturated while commands jump to and fro."""
    sim = build(cls, robot, model)
    arm = sim.robots["robot"]
    positions, saturated = np.zeros((steps, arm.dof)), np.zeros((steps, arm.dof), np.bool_)
    signs = np.where(np.arange(arm.dof) % 2, 1.0, -1.0)
    for k in range(steps):
        if k % 250 == 0:
            arm.command(arm.home + jump * signs * (1.0 if k % 500 == 0 else -1.0))
        sim.step(1)
        positions[k] = arm.joint_positions[0]
        saturated[k] = np.abs(arm.joint_efforts[0]) >= arm.effort_limit[0]
    sim.close()
    return positions, saturated


@pytest.mark.parametrize(("effort", "jump"), [(np.inf, 0.4), (30.0, 1.5)], ids=["within the limits", "at the limits"])
def test_two_seconds_of_free_motion_are_mujocos_to_a_millionth_of_a_radian(effort: float, jump: float) -> None:
    model = with_joints(_MODEL, effort=effort)
    (there, _), (here, saturated) = (step_response(cls, IRB120, model, jump) for cls in ENGINES)
    assert np.abs(there - here).max() <= 1e-6
    assert np.ptp(here, axis=0).min() > 0.3
    assert (saturated.any(axis=1).mean() >= 0.2) == np.isfinite(effort)


@pytest.mark.parametrize("changes", [{"damping": 5.0}, {"friction": 2.0}], ids=lambda changes: next(iter(changes)))
def test_joints_that_resist_do_so_as_in_mujoco(changes: dict[str, float]) -> None:
    (there, _), (here, _) = (step_response(cls, IRB120, with_joints(_MODEL, **changes), 0.4, 300) for cls in ENGINES)
    free, _ = step_response(PybulletSimulation, IRB120, with_joints(_MODEL), 0.4, 300)
    assert np.abs(there - here).max() <= 1e-6
    assert np.abs(free - here).max() > 1e-3


def test_the_inertia_of_the_motors_acts_as_in_mujoco() -> None:
    geared = replace(IRB120, armature=dict.fromkeys(_MODEL.joint_names, 3.0))
    (there, _), (here, _) = (step_response(cls, geared, with_joints(_MODEL), 0.4, 300) for cls in ENGINES)
    free, _ = step_response(PybulletSimulation, IRB120, with_joints(_MODEL), 0.4, 300)
    assert np.abs(there - here).max() <= 1e-6
    assert np.abs(free - here).max() > 1e-2


def test_a_floating_robots_joints_move_as_in_mujoco() -> None:
    floating = replace(IRB120, base="floating")
    (there, _), (here, _) = (step_response(cls, floating, _MODEL, 0.2, 300) for cls in ENGINES)
    assert np.abs(there - here).max() <= 1e-6


def test_a_tilted_arm_and_one_that_is_pushed_move_as_in_mujoco() -> None:
    motions = []
    for cls in ENGINES:
        sim = build(
            cls, IRB120, with_joints(_MODEL), pose=Pose((0.1, 0.2, 0.3), (0.8, 0.36, -0.16, 0.4525483399593904))
        )
        arm = sim.robots["robot"]
        arm.command(arm.home + 0.1)
        sim.apply_wrench("robot/link_4", np.array([20.0, -10.0, 5.0]), np.array([1.0, 2.0, -0.5]))
        sim.step(100)
        motions.append(np.concatenate([arm.joint_positions[0], *(array[0] for array in arm.frame_pose("tcp"))]))
        sim.close()
    assert np.abs(motions[0] - motions[1]).max() < 1e-6


@pytest.mark.parametrize(
    ("name", "target", "change"),
    [
        ("mass", "robot/link_3", lambda value: 1.7 * value),
        ("mass", "robot/base_link", lambda value: 1.7 * value),
        ("gravity", "", lambda value: value + np.array([1.0, 2.0, 5.0])),
        ("joint_damping", "robot", lambda value: value + 2.0),
        ("stiffness", "robot", lambda value: 0.6 * value),
        ("damping", "robot", lambda value: 0.6 * value),
    ],
    ids=lambda value: value.replace("/", " ") if isinstance(value, str) else "",
)
def test_a_parameter_changes_the_motion_as_in_mujoco(
    name: str, target: str, change: Callable[[Floats], Floats]
) -> None:
    motions = []
    for cls in ENGINES:
        sim = build(cls, IRB120, with_joints(_MODEL))
        arm = sim.robots["robot"]
        sim.write_parameter(name, target, change(sim.parameter(name, target)))
        arm.command(arm.home + 0.2)
        sim.step(50)
        motions.append(arm.joint_positions[0].copy())
        sim.close()
    assert np.abs(motions[0] - motions[1]).max() < 1e-9


@pytest.mark.needs("pinocchio")
def test_kinematics_and_jacobians_are_pinocchios(tmp_path: Path) -> None:
    import pinocchio as pin

    model = _MODEL
    path = tmp_path / "irb120.urdf"
    path.write_text(model.xml)
    reference = pin.buildModelFromUrdf(str(path))
    data = reference.createData()
    sim = build(PybulletSimulation, IRB120, model)
    arm, rng = sim.robots["robot"], np.random.default_rng(0)
    frame = reference.getFrameId("tool0")
    for _ in range(20):
        q = rng.uniform(arm.position_lower, arm.position_upper)
        arm.write_joint_state(q)
        pin.computeJointJacobians(reference, data, q[0])
        pin.updateFramePlacements(reference, data)
        jacobian = pin.getFrameJacobian(reference, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        assert arm.frame_pose("tcp")[0][0] == pytest.approx(data.oMf[frame].translation, abs=1e-9)
        assert arm.frame_jacobian("tcp")[0] == pytest.approx(jacobian, abs=1e-9)
    sim.close()


@pytest.mark.parametrize("base", ["fixed", "floating"])
def test_a_jacobian_is_the_derivative_of_the_pose_whatever_the_inertia_s_axes(base: str) -> None:
    *others, last = _MODEL.joints  # the tool, off the flange and turned
    tool = replace(last, origin=Pose((0.1, -0.05, 0.2), (0.8, 0.36, -0.16, 0.4525483399593904)))
    pose = Pose((0.1, 0.2, 0.3), (0.8, 0.0, 0.6, 0.0))
    sim = build(PybulletSimulation, replace(IRB120, base=base), replace(_MODEL, joints=(*others, tool)), pose=pose)
    arm, h = sim.robots["robot"], 1e-6
    q = arm.home + 0.2
    v = np.linspace(-1.0, 1.0, 6)[None]
    arm.write_joint_state(q, v)
    steps = h * np.eye(6)
    slope = [(arm.frame_pose("tcp", q + d)[0][0] - arm.frame_pose("tcp", q - d)[0][0]) / (2.0 * h) for d in steps]
    assert arm.frame_jacobian("tcp")[0, :3] == pytest.approx(np.stack(slope, axis=1), abs=1e-8)
    twist = np.concatenate([part[0] for part in arm.frame_velocity("tcp")])
    assert twist == pytest.approx((arm.frame_jacobian("tcp")[0] * v).sum(axis=1), abs=1e-12)
    sim.close()


def test_rays_measure_what_mujocos_do(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    shapes = (Box((0.4, 0.6, 1.0)), Sphere(0.3), Cylinder(0.25, 1.0), Capsule(0.2, 0.5))
    bodies = {}
    for i in range(12):
        angle = 2.0 * np.pi * i / 12
        quat = rng.normal(size=4)
        quat /= np.linalg.norm(quat)
        pos = (2.5 * np.cos(angle), 2.5 * np.sin(angle), 0.1)
        bodies[f"body_{i}"] = Body(geometry=shapes[i % 4], pose=Pose(pos, tuple(quat.tolist())), kinematic=True)
    angles = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles), -0.02 + 0.0 * angles], axis=-1)[None]
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    origins = np.broadcast_to(np.array([0.0, 0.0, 0.3]), directions.shape)
    found = []
    for cls in ENGINES:
        placement = place(tmp_path, "arm", pos=(0.0, 0.0, 5.0))
        sim = cls({"robot": placement}, Scene(bodies=bodies), num_envs=1, physics_timestep=TIMESTEP)
        sim.reset()
        found.append(sim.rays(origins, directions, 10.0)[0])
        sim.close()
    grazing = np.abs(found[0] - found[1]) > 1e-3
    assert (found[0] < 9.0).mean() > 0.3
    assert grazing.sum() <= 1, f"{grazing.sum()} of 360 rays differ: {np.abs(found[0] - found[1])[grazing]}"


def test_the_drive_law_holds_in_closed_form_for_every_way_that_it_is_computed() -> None:
    from frobs_sim_pybullet.general_law import GeneralLaw
    from frobs_sim_pybullet.law import law

    rng = np.random.default_rng(0)
    h = 0.002
    for offset, count in ((0, 1), (0, 6), (6, 3), (0, 12)):
        size = offset + count
        square = rng.normal(size=(size, size))
        mass, bias = square @ square.T + np.eye(size), rng.normal(size=size)
        q, v, command = rng.normal(size=(3, count))
        kp, kd, damping, armature = rng.uniform(0.0, 50.0, (4, count))
        limit = np.where(np.arange(count) % 2, 1.0, np.inf)
        effort = kp * (command - q) - kd * v
        full = np.zeros(size)
        full[offset:] = armature + h * (damping + np.where(np.abs(effort) >= limit, 0.0, kd))
        applied = np.clip(effort, -limit, limit)
        right = -bias
        right[offset:] += applied - damping * v
        acceleration = np.linalg.solve(mass + np.diag(full), right)
        constants = np.stack([kp, kd, limit, damping, armature + h * damping, h * kd], axis=1).tolist()
        given = (q.tolist(), v.tolist(), (kp * command).tolist(), constants, mass.tolist(), bias.tolist())
        for way in (law, GeneralLaw(offset, count, None, armature.tolist(), ())):
            torques, efforts = way(*given)
            assert efforts == pytest.approx(applied, abs=1e-12)
            assert torques == pytest.approx((mass @ acceleration + bias)[offset:], abs=1e-9)

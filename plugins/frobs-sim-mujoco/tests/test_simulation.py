from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from robots import place

from frobs_core import plugins
from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Contact, Scene
from frobs_core.models import Box, Pose
from frobs_core.util.errors import UnknownNameError
from frobs_devkit.testing.simulator.under_test import BALL, SimulatorUnderTest
from frobs_sim_mujoco.simulation import MujocoSimulation


def simulate(
    folder: Path, *names: str, num_envs: int = 3, scene: Scene | None = None, **placing: object
) -> MujocoSimulation:
    robots = {("robot" if i == 0 else name): place(folder, name, **placing) for i, name in enumerate(names)}
    return MujocoSimulation(robots, scene or Scene(), num_envs=num_envs, physics_timestep=0.002)


@pytest.mark.parametrize("limit", [200.0, 3.0], ids=["free", "saturated"])
def test_the_drive_law_holds_to_the_last_digit(tmp_path: Path, limit: float) -> None:
    folder = tmp_path
    placement = place(folder, "arm")
    text = (folder / "arm.urdf").read_text().replace('effort="200"', f'effort="{limit}"')
    (folder / "arm.urdf").write_text(text)
    placement = place.__globals__["Placement"](
        robot=placement.robot,
        model=place.__globals__["load_model"](folder / "arm.urdf"),
        command_mode=CommandMode.POSITION,
    )
    sim = MujocoSimulation({"robot": placement}, Scene(gravity=(0, 0, 0)), num_envs=1, physics_timestep=0.002)
    sim.reset()
    arm = sim.robots["robot"]
    kp, kd = (gain[0] for gain in arm.drive_gains())
    target = arm.joint_positions[0] + 0.4
    model, h = sim.native.model, 0.002
    saturated = 0
    for _ in range(50):
        data = sim.native.batch.get_data(0)
        mujoco.mj_forward(model, data)
        mass = np.zeros((2, 2))
        mujoco.mj_fullM(model, data, mass)
        q, v = arm.joint_positions[0].copy(), arm.joint_velocities[0].copy()
        effort = kp * (target - q) - kd * v
        clipped = np.abs(effort) >= limit
        saturated += clipped.any()
        effort = np.clip(effort, -limit, limit)
        acceleration = np.linalg.solve(mass + h * np.diag(np.where(clipped, 0.0, kd)), effort - data.qfrc_bias)
        arm.command(target[None])
        sim.step(1)
        assert arm.joint_velocities[0] == pytest.approx(v + h * acceleration, abs=1e-12)
    assert (saturated > 5) == (limit == 3.0)


def test_hard_contacts_need_the_discrete_integrator(tmp_path: Path) -> None:
    implicit, discrete = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtIntegrator.mjINT_DISCRETE
    for hard, integrator, seconds in ((False, implicit, 0.02), (True, discrete, 0.004)):
        model = simulate(tmp_path, "arm", scene=Scene(bodies={"ball": BALL}, hard_contacts=hard)).model
        assert model.opt.integrator == integrator
        assert model.geom_solref[model.body("ball").geomadr[0], 0] == pytest.approx(seconds)
    robots = {"robot": place(tmp_path, "arm")}
    given = MujocoSimulation(robots, Scene(), num_envs=1, physics_timestep=0.002, integrator="discrete")
    assert given.model.opt.integrator == discrete


def test_the_armature_of_a_joint_is_set(tmp_path: Path) -> None:
    placement = place(tmp_path, "arm")
    joint = placement.model.joint_names[0]
    geared = replace(placement, robot=replace(placement.robot, armature={joint: 2.5}))
    model = MujocoSimulation({"robot": geared}, Scene(), num_envs=1, physics_timestep=0.002).model
    assert model.joint(f"robot/{joint}").armature[0] == 2.5
    wrong = replace(placement, robot=replace(placement.robot, armature={"none": 2.5}))
    with pytest.raises(UnknownNameError, match="'none'"):
        MujocoSimulation({"robot": wrong}, Scene(), num_envs=1, physics_timestep=0.002)


@pytest.mark.needs("rendering")
def test_fast_depth_is_that_of_full_quality(tmp_path: Path) -> None:
    sim = simulate(tmp_path, "arm", num_envs=1)
    try:
        full, fast = (sim.render(size=(84, 84), modality="depth", fast=only_fast) for only_fast in (False, True))
        assert np.mean(np.abs(fast - full) > 0.01) < 0.01  # silhouettes may differ by a pixel
    finally:
        sim.close()


@pytest.mark.slow
@pytest.mark.needs("rendering")
def test_images_of_all_sizes_are_drawn_from_one_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sim = simulate(tmp_path, "arm", num_envs=2)
    built: list[bool] = []
    build = sim._drawn
    monkeypatch.setattr(sim, "_drawn", lambda: built.append(True) or build())
    try:
        # Mesa may draw single pixels of a context's first image differently.
        first = sim.render(size=(48, 64), fast=True)
        for size in ((84, 84), (1500, 2000)):  # the second exceeds 1920 x 1440
            assert sim.render(size=size, fast=True).shape == (2, *size, 3)
        assert np.mean(sim.render(size=(48, 64), fast=True) != first) < 1e-3
        assert len(built) == 1
        for width in range(10, 20):  # more sizes than contexts are kept
            sim.render(size=(10, width), fast=True)
        assert np.mean(sim.render(size=(48, 64), fast=True) != first) < 1e-3
    finally:
        sim.close()


def test_efforts_stay_those_of_the_last_step_when_poses_are_read_and_states_restored() -> None:
    subject = SimulatorUnderTest(plugins.get_record("simulator", "mujoco"))
    efforts = []
    for contacts in ({}, {"ball": Contact(first="ball")}):  # with contacts, poses are computed when they are read
        with subject.build(num_envs=3, bodies={"ball": BALL}, contacts=contacts, num_threads=1) as (sim, robot):
            robot.command(robot.home + np.array([[0.1], [0.2], [0.3]]))
            sim.step(5)
            robot.frame_pose("tcp")
            efforts.append(robot.joint_efforts.copy())
            snapshot = sim.snapshot()
            sim.step(5)
            sim.restore(snapshot)
            robot.frame_pose("tcp")
            assert (robot.joint_efforts == efforts[-1]).all()
            sim.reset()
            assert not robot.joint_efforts.any()
    assert (efforts[0] == efforts[1]).all()


def test_one_environment_with_contacts_has_the_bits_of_many(tmp_path: Path) -> None:
    """One computes poses, velocities and rays without the batch."""
    scene = Scene(
        bodies={"post": Body(geometry=Box((0.1, 0.1, 0.5)), pose=Pose((0.5, 0.1, 0.25)), kinematic=True)},
        contacts={"touch": Contact(first="robot/hull", ignore=("floor",))},
    )
    alone, many = (
        simulate(tmp_path, "rover", num_envs=n, scene=scene, mode=CommandMode.VELOCITY, pos=(0, 0, 0.07))
        for n in (1, 2)
    )
    for sim in (alone, many):
        sim.reset()
    for step in range(40):
        if step == 10:  # what derives from the model changes too
            for sim in (alone, many):
                sim.write_parameter("mass", "robot/left_wheel", np.full(sim.num_envs, 0.3))
                sim.write_body_poses(["post"], np.full((sim.num_envs, 1, 3), [0.35, 0.0, 0.25]))
        for sim in (alone, many):
            sim.robots["robot"].command(np.full((sim.num_envs, 2), [8.0, 8.0 + 0.05 * step]))
            sim.step(10)
        one, two = alone.robots["robot"], many.robots["robot"]
        for mine, theirs in zip((*one.base_pose, *one.base_twist), (*two.base_pose, *two.base_twist), strict=True):
            assert mine[0].tobytes() == theirs[0].tobytes()
        assert one.frame_jacobian("hull")[0].tobytes() == two.frame_jacobian("hull")[0].tobytes()
        assert one.lidar("lidar")[0].tobytes() == two.lidar("lidar")[0].tobytes()
        assert alone.contact("touch")[0] == many.contact("touch")[0]
    assert one.lidar("lidar").min() < 1.0
    assert many.contact("touch").all()

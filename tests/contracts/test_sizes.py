"""Bodies whose size differs between environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
import trimesh
from arm_and_gripper import ARM

from frobs_core import plugins
from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Body, Camera, Placement, Scene, Shape
from frobs_core.models import Box, Mesh, Pose, Sphere, load_model
from frobs_core.util.errors import PhysicsParameterError

Simulate: TypeAlias = Callable[..., Simulation]

ROBOT = Placement(robot=ARM, model=load_model(ARM.model), command_mode=CommandMode.POSITION)
CAMERA = Camera(pos=(1.0, 0.0, 1.0), target=(0.0, 0.0, 0.1))


def dumbbell(size: float, mass: float = 0.4) -> Body:
    """Return a body of two shapes whose center of mass is not in its origin."""
    shapes = (
        Shape(Box((0.1 * size, 0.06 * size, 0.04 * size))),
        Shape(Sphere(0.03 * size), Pose((0.09 * size, 0.0, 0.02 * size))),
    )
    return Body(shapes=shapes, mass=mass, pose=Pose((0.0, 0.0, 0.3), (0.96, 0.2, 0.0, 0.196)))


@pytest.fixture(params=["mujoco", "pybullet"])
def simulate(request: pytest.FixtureRequest) -> Callable[..., Simulation]:
    implementation = plugins.get_record("simulator", request.param).load()
    return lambda scene, num_envs=1, robots={}, **options: implementation(
        robots, scene, num_envs=num_envs, physics_timestep=0.002, **options
    )


def trace(sim: Simulation, env: int) -> np.ndarray:
    rows = []
    for _ in range(60):
        sim.step(10)
        pos, quat = sim.bodies["body"].pose
        rows.append(np.concatenate([pos[env], quat[env]]))
    return np.array(rows)


def test_a_written_size_moves_as_a_body_that_was_built_with_it(simulate: Simulate) -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}), num_envs=3)) as sim:
        sim.write_parameter("size", "body", np.array([2.0]), np.array([False, True, False]))
        sim.write_parameter("mass", "body", np.array([0.7]), np.array([False, True, False]))
        sim.write_parameter("size", "body", np.array([1.5]), np.array([False, True, False]))
        assert sim.parameter("size", "body").tolist() == [1.0, 1.5, 1.0]
        found = trace(sim, 1)
    with closing(simulate(Scene(bodies={"body": dumbbell(1.5, 0.7)}))) as built:
        assert found == pytest.approx(trace(built, 0), abs=1e-5)


def test_a_size_that_is_written_in_motion_changes_no_other_state(simulate: Simulate) -> None:
    thrown = replace(dumbbell(1.0), twist=((0.3, 0.0, 1.0), (1.0, 2.0, 0.5)))
    ball = Body(geometry=Sphere(0.05), pose=Pose((1.0, 0.0, 0.5)), mass=0.2)
    with closing(simulate(Scene(bodies={"body": thrown, "ball": ball}), 2, {"robot": ROBOT})) as sim:
        robot = sim.robots["robot"]
        robot.command(robot.home + 0.3)
        sim.step(20)

        def state() -> np.ndarray:
            joints = [robot.joint_positions, robot.joint_velocities, robot.joint_efforts, sim.time[:, None]]
            bodies = [array for body in sim.bodies.values() for array in (*body.pose, *body.twist)]
            return np.concatenate([*joints, *bodies], axis=1)

        before = state()
        push = np.array([[0.0, 4.0, 0.0]])
        sim.apply_wrench("ball", push, np.zeros((1, 3)))
        sim.write_parameter("size", "body", np.array([1.5, 1.0]))
        assert state() == pytest.approx(before, abs=1e-6)
        sim.step(10)
        assert sim.bodies["ball"].twist[0][:, 1] == pytest.approx([0.4, 0.4])
        sim.reset()
        assert sim.bodies["body"].pose[0] == pytest.approx(np.array([thrown.pose.pos] * 2), abs=1e-6)


def test_a_snapshot_holds_the_sizes(simulate: Simulate) -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}), num_envs=2)) as sim:
        sim.write_parameter("size", "body", np.array([0.5, 2.0]))
        sim.step(20)
        saved = sim.snapshot()
        expected = trace(sim, 1)
        sim.write_parameter("size", "body", np.array([1.0, 1.0]))
        sim.restore(saved)
        assert sim.parameter("size", "body").tolist() == [0.5, 2.0]
        assert (trace(sim, 1) == expected).all()


@pytest.mark.needs("rendering", on="mujoco")
def test_images_show_the_size(simulate: Simulate) -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}, cameras={"eye": CAMERA}), num_envs=2)) as sim:
        as_built = sim.snapshot()
        sim.write_parameter("size", "body", np.array([1.0, 2.0]))
        images = sim.render(camera="eye", size=(64, 64), modality="segmentation")
        small, large = (images == 1).sum(axis=(1, 2, 3))
        assert large > 2.5 * small
        sim.restore(as_built)
        restored = sim.render(camera="eye", size=(64, 64), modality="segmentation")
        assert (restored[1] == restored[0]).all()


@pytest.fixture
def with_mesh(tmp_path: Path, simulate: Simulate) -> Iterator[Simulation]:
    mesh = tmp_path / "part.stl"
    trimesh.creation.box((0.1, 0.1, 0.1)).export(mesh)
    with closing(simulate(Scene(bodies={"part": Body(geometry=Mesh(mesh), mass=1.0)}))) as sim:
        yield sim


def test_what_has_no_size_is_refused(with_mesh: Simulation) -> None:
    assert with_mesh.parameter_targets("size") == []
    for target in ("part", "floor", "nothing"):
        with pytest.raises(PhysicsParameterError, match="consist of primitives"):
            with_mesh.write_parameter("size", target, np.ones(1))


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_a_size_is_above_zero(simulate: Simulate, value: float) -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}))) as sim, pytest.raises(PhysicsParameterError):
        sim.write_parameter("size", "body", np.array([value]))


@pytest.mark.needs("pybullet")
def test_worker_processes_of_pybullet_resize_their_own_environments() -> None:
    implementation = plugins.get_record("simulator", "pybullet").load()
    scene = Scene(bodies={"body": dumbbell(1.0)})
    ends = []
    for workers in (1, 2):
        with closing(implementation({}, scene, num_envs=3, physics_timestep=0.002, num_threads=workers)) as sim:
            sim.write_parameter("size", "body", np.array([1.0, 2.0, 0.5]))
            sim.step(200)
            ends.append(np.concatenate(sim.bodies["body"].pose, axis=1))
    assert (ends[0] == ends[1]).all()
    assert len(np.unique(ends[0][:, 2].round(3))) == 3

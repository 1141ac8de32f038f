"""Bodies whose size differs between environments."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import trimesh

from frobs_core.errors import PhysicsParameterError, RenderingUnavailableError
from frobs_core.interfaces import Body, Camera, Scene, Shape
from frobs_core.models import Box, Mesh, Pose, Sphere
from frobs_sim_mujoco.simulation import MujocoSimulation

CAMERA = Camera(pos=(1.0, 0.0, 1.0), target=(0.0, 0.0, 0.1))


def dumbbell(size: float, mass: float = 0.4) -> Body:
    """Return a body of two shapes whose center of mass is not in its origin."""
    shapes = (
        Shape(Box((0.1 * size, 0.06 * size, 0.04 * size))),
        Shape(Sphere(0.03 * size), Pose((0.09 * size, 0.0, 0.02 * size))),
    )
    return Body(shapes=shapes, mass=mass, pose=Pose((0.0, 0.0, 0.3)))


def simulate(scene: Scene, num_envs: int = 1) -> MujocoSimulation:
    return MujocoSimulation({}, scene, num_envs=num_envs, physics_timestep=0.002)


def trace(sim: MujocoSimulation, env: int) -> np.ndarray:
    rows = []
    for _ in range(60):
        sim.step(10)
        pos, quat = sim.bodies["body"].pose
        rows.append(np.concatenate([pos[env], quat[env]]))
    return np.array(rows)


def test_a_written_size_moves_as_a_body_that_was_built_with_it() -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}), num_envs=3)) as sim:
        sim.write_parameter("size", "body", np.array([2.0]), np.array([False, True, False]))
        sim.write_parameter("mass", "body", np.array([0.7]), np.array([False, True, False]))
        sim.write_parameter("size", "body", np.array([1.5]), np.array([False, True, False]))
        assert sim.parameter("size", "body").tolist() == [1.0, 1.5, 1.0]
        found = trace(sim, 1)
    with closing(simulate(Scene(bodies={"body": dumbbell(1.5, 0.7)}))) as built:
        assert found == pytest.approx(trace(built, 0), abs=1e-6)


def test_a_snapshot_holds_the_sizes() -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}), num_envs=2)) as sim:
        sim.write_parameter("size", "body", np.array([0.5, 2.0]))
        sim.step(20)
        saved = sim.snapshot()
        expected = trace(sim, 1)
        sim.write_parameter("size", "body", np.array([1.0, 1.0]))
        sim.restore(saved)
        assert sim.parameter("size", "body").tolist() == [0.5, 2.0]
        assert (trace(sim, 1) == expected).all()


def test_images_show_the_size() -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}, cameras={"eye": CAMERA}), num_envs=2)) as sim:
        as_built = sim.snapshot()
        sim.write_parameter("size", "body", np.array([1.0, 2.0]))
        try:
            images = sim.render(camera="eye", size=(64, 64), modality="segmentation")
        except RenderingUnavailableError as error:
            pytest.skip(str(error))
        small, large = (images == sim.model.body("body").id).sum(axis=(1, 2, 3))
        assert large > 2.5 * small
        sim.restore(as_built)
        restored = sim.render(camera="eye", size=(64, 64), modality="segmentation")
        assert (restored[1] == restored[0]).all()


@pytest.fixture
def with_mesh(tmp_path: Path) -> Iterator[MujocoSimulation]:
    mesh = tmp_path / "part.stl"
    trimesh.creation.box((0.1, 0.1, 0.1)).export(mesh)
    with closing(simulate(Scene(bodies={"part": Body(geometry=Mesh(mesh), mass=1.0)}))) as sim:
        yield sim


def test_what_has_no_size_is_refused(with_mesh: MujocoSimulation) -> None:
    assert with_mesh.parameter_targets("size") == []
    for target in ("part", "floor", "nothing"):
        with pytest.raises(PhysicsParameterError, match="made of primitives"):
            with_mesh.write_parameter("size", target, np.ones(1))


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_a_size_is_above_zero(value: float) -> None:
    with closing(simulate(Scene(bodies={"body": dumbbell(1.0)}))) as sim, pytest.raises(PhysicsParameterError):
        sim.write_parameter("size", "body", np.array([value]))

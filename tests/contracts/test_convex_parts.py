"""Meshes that collide as convex pieces instead of as their convex hull."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import trimesh

from frobs_core import plugins
from frobs_core.contracts import Simulation
from frobs_core.description import Body, Scene, Shape
from frobs_core.models import Mesh, Pose, Sphere
from frobs_core.util.errors import MissingDependencyError, ModelFileError
from frobs_models import convex_parts
from frobs_models.meshes.convex_parts import MAX_FACES

RADIUS = 0.03  # [m] of the ball


@pytest.fixture
def ring(tmp_path: Path) -> Path:
    path = tmp_path / "ring.stl"
    trimesh.creation.annulus(0.04, 0.06, 0.02, sections=16).export(path)  # its center is at z = 0
    return path


@pytest.fixture
def cup(tmp_path: Path) -> Path:
    path = tmp_path / "cup.stl"
    profile = [[0.0, 0.0], [0.06, 0.0], [0.06, 0.08], [0.05, 0.08], [0.05, 0.01], [0.0, 0.01]]
    trimesh.creation.revolve(profile, sections=16).export(path)
    return path


@pytest.fixture(
    params=["mujoco", "pybullet", pytest.param("gazebo", marks=[pytest.mark.slow, pytest.mark.needs("gazebo")])]
)
def simulator(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def drop(simulator: str, body: Body) -> Simulation:
    """Return a simulation of a ball that was dropped onto a body."""
    ball = Body(geometry=Sphere(RADIUS), pose=Pose((0.0, 0.0, 0.14)), mass=0.1)
    scene = Scene(bodies={"body": body, "ball": ball})
    sim: Simulation = plugins.get_record("simulator", simulator).load()({}, scene, num_envs=1, physics_timestep=0.002)
    sim.step(500)
    return sim


@pytest.mark.needs("coacd")
@pytest.mark.parametrize(("decomposed", "height"), [(True, RADIUS), (False, 0.02 + RADIUS)])
def test_a_ball_falls_through_a_ring_only_if_the_ring_is_decomposed(
    simulator: str, decomposed: bool, height: float, ring: Path
) -> None:
    shape = Shape(Mesh(ring, decomposed=decomposed), Pose((0.0, 0.0, 0.01)))
    with closing(drop(simulator, Body(shapes=(shape,), density=1000.0))) as sim:
        assert sim.bodies["ball"].pose[0][0, 2] == pytest.approx(height, abs=2e-3)
        assert sim.bodies["body"].pose[0][0, 2] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.needs("coacd")
def test_a_cup_holds_a_ball(simulator: str, cup: Path) -> None:
    with closing(drop(simulator, Body(geometry=Mesh(cup, decomposed=True)))) as sim:
        ball = sim.bodies["ball"]
        ball.write_twist(np.array([[0.2, 0.1, 0.0]]), np.zeros((1, 3)))
        sim.step(500)
        x, y, z = ball.pose[0][0]
        assert np.hypot(x, y) < 0.03
        assert z == pytest.approx(0.01 + RADIUS, abs=2e-3)


@pytest.mark.needs("coacd")
def test_pieces_have_the_volume_of_the_mesh_and_its_scale(ring: Path) -> None:
    pieces = convex_parts(Mesh(ring, (2.0, 1.0, 1.0), decomposed=True))
    assert 4 <= len(pieces) <= 64
    hulls = [trimesh.Trimesh(piece.vertices, piece.faces).convex_hull for piece in pieces]
    assert sum(hull.volume for hull in hulls) == pytest.approx(2.0 * trimesh.load_mesh(ring).volume, rel=0.1)


@pytest.mark.needs("coacd")
def test_pieces_are_computed_once(ring: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import coacd

    first = convex_parts(Mesh(ring, decomposed=True))
    monkeypatch.delattr(coacd, "run_coacd")
    copy = ring.with_name("copy.stl")
    copy.write_bytes(ring.read_bytes())
    second = convex_parts(Mesh(copy, decomposed=True))
    assert all((a.vertices == b.vertices).all() for a, b in zip(first, second, strict=True))


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "ring.stl"
    trimesh.creation.torus(0.1, 0.0321).export(path)
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(MissingDependencyError, match=r"coacd; install with: pip install -e '.*\[decomposition\]'"):
        convex_parts(Mesh(path, decomposed=True))


def test_a_mesh_that_would_take_minutes_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "ring.stl"
    trimesh.creation.torus(0.1, 0.03, major_sections=400, minor_sections=200).export(path)
    with pytest.raises(ModelFileError, match=f"at most {MAX_FACES:,} can be decomposed"):
        convex_parts(Mesh(path, decomposed=True))

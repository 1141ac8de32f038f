from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from frobs_core.models import Box, Capsule, Collision, Cylinder, Geometry, Link, Mesh, Pose, Sphere, load_model
from frobs_core.util.errors import ModelFileError
from frobs_models.bounds import link_bounds, robot_bounds, shape_points

TURNED = Pose((1.0, 0.0, 0.0), (math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0))  # z to −y


@pytest.mark.parametrize(
    ("geometry", "size"),
    [
        (Box((1.0, 2.0, 3.0)), (1.0, 3.0, 2.0)),
        (Sphere(0.5), (1.0, 1.0, 1.0)),
        (Cylinder(0.5, 3.0), (1.0, 3.0, 1.0)),
        (Capsule(0.5, 3.0), (1.0, 4.0, 1.0)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_box_around_a_shape_is_tight(geometry: Geometry, size: tuple[float, ...]) -> None:
    points = shape_points(Collision(geometry, TURNED))
    assert points.max(axis=0) - points.min(axis=0) == pytest.approx(size)
    assert (points.max(axis=0) + points.min(axis=0)) / 2 == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


def test_of_a_large_mesh_the_farthest_points_are_kept(tmp_path: Path) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=5, radius=2.0)
    ball.export(tmp_path / "ball.stl")
    points = shape_points(Collision(Mesh(tmp_path / "ball.stl", (1.0, 2.0, -1.0))))
    assert len(points) < 300 < len(ball.vertices)
    assert points.max(axis=0) == pytest.approx((2.0, 4.0, 2.0), rel=1e-3)


def test_a_mesh_that_cannot_be_read_has_no_size(tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_bytes(b"x")
    shape = Collision(Mesh(tmp_path / "bad.stl"))
    with pytest.raises(ModelFileError):
        shape_points(shape)
    assert link_bounds(Link("l", collisions=(shape,))) is None
    assert link_bounds(Link("l", collisions=(shape, Collision(Sphere(1.0))))) is not None


def test_a_robots_box_moves_with_its_joints(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(
        '<robot name="r"><link name="a"/><link name="b"><visual><origin xyz="1 0 0"/><geometry><box size="2 .2 .2"/>'
        '</geometry></visual></link><joint name="j" type="continuous"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/></joint></robot>'
    )
    model = load_model(path)
    assert np.stack(robot_bounds(model, [0.0])).tolist() == pytest.approx(np.array([[0, -0.1, -0.1], [2, 0.1, 0.1]]))
    assert np.stack(robot_bounds(model, [math.pi / 2])) == pytest.approx(
        np.array([[-0.1, 0, -0.1], [0.1, 2, 0.1]]), abs=1e-9
    )

from pathlib import Path

import numpy as np
import pytest
import trimesh

from frobs_core.models import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Mesh,
    Pose,
    Sphere,
    inertia_matrix,
    solid_inertial,
)
from frobs_core.util.errors import ModelFileError

TURNED = Pose((0.3, -0.2, 0.1), (0.8, 0.36, -0.16, 0.4525483399593904))


def as_trimesh(geometry: Geometry) -> trimesh.Trimesh:
    match geometry:
        case Box(size):
            return trimesh.creation.box(size)
        case Sphere(radius):
            return trimesh.creation.icosphere(5, radius)
        case Cylinder(radius, length):
            return trimesh.creation.cylinder(radius, length, sections=400)
        case Capsule(radius, length):
            capsule = trimesh.creation.capsule(length, radius, [200, 200])
            return capsule.apply_translation(-capsule.center_mass)
    raise TypeError(geometry)


@pytest.mark.parametrize(
    "geometry",
    [Box((0.1, 0.2, 0.3)), Sphere(0.2), Cylinder(0.1, 0.4), Capsule(0.1, 0.3)],
    ids=lambda g: type(g).__name__,
)
def test_a_primitive_weighs_what_its_triangles_do(geometry: Geometry) -> None:
    solid = as_trimesh(geometry)
    found = solid_inertial([Collision(geometry, TURNED)], density=500.0)
    turn = trimesh.transformations.quaternion_matrix(TURNED.quat_wxyz)[:3, :3]
    assert found.mass == pytest.approx(500.0 * solid.volume, rel=2e-3)
    assert found.origin.pos == pytest.approx(TURNED.pos)
    expected = turn @ solid.moment_inertia @ turn.T * 500.0
    np.testing.assert_allclose(inertia_matrix(found), expected, atol=4e-3 * np.abs(expected).max())


def test_several_shapes_weigh_what_their_union_does() -> None:
    stick, head = Box((0.3, 0.04, 0.04)), Box((0.06, 0.2, 0.06))
    union = trimesh.util.concatenate(
        [trimesh.creation.box(stick.size), trimesh.creation.box(head.size).apply_translation((0.18, 0.02, 0.0))]
    )
    found = solid_inertial([Collision(stick), Collision(head, Pose((0.18, 0.02, 0.0)))], mass=0.7)
    assert found.mass == 0.7
    np.testing.assert_allclose(found.origin.pos, union.center_mass, atol=1e-12)
    np.testing.assert_allclose(inertia_matrix(found), union.moment_inertia * 0.7 / union.volume, rtol=1e-9)


def test_a_closed_mesh_weighs_what_it_encloses_and_an_open_one_is_refused(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.1, 0.2, 0.3)).apply_translation((0.5, 0.0, 0.0))
    box.export(tmp_path / "closed.stl")
    found = solid_inertial([Collision(Mesh(tmp_path / "closed.stl", (2.0, 2.0, 2.0)))], density=100.0)
    expected = solid_inertial([Collision(Box((0.2, 0.4, 0.6)), Pose((1.0, 0.0, 0.0)))], density=100.0)
    assert found.mass == pytest.approx(expected.mass, rel=1e-6)
    assert found.origin.pos == pytest.approx(expected.origin.pos, abs=1e-6)
    np.testing.assert_allclose(found.inertia, expected.inertia, atol=1e-6)
    box.update_faces(np.arange(len(box.faces)) > 0)
    box.export(tmp_path / "open.stl")
    with pytest.raises(ModelFileError, match="not closed"):
        solid_inertial([Collision(Mesh(tmp_path / "open.stl"))], mass=1.0)

from typing import Any

import pytest

import frobs_core.plugins
from frobs_core.description import Attachment, Body, Scene, Shape
from frobs_core.models import Box, Pose, Sphere
from frobs_core.util.errors import ParameterValueError, SceneError
from frobs_devkit.testing.simulator.under_test import SimulatorUnderTest

MOMENTS = (0.1, 0.0, 0.0, 0.1, 0.0, 0.1)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "exactly one"),
        ({"geometry": Sphere(0.1), "shapes": (Shape(Sphere(0.1)),)}, "exactly one"),
        ({"geometry": Sphere(0.1), "mass": 1.0, "density": 1.0}, "pass only one of them"),
        ({"geometry": Sphere(0.1), "inertia": MOMENTS}, "no mass"),
        (
            {"geometry": Sphere(0.1), "mass": 1.0, "inertia": (-0.1, 0.0, 0.0, 0.1, 0.0, 0.1)},
            "moments are -0.1, 0.1, 0.1",
        ),
        ({"geometry": Sphere(0.1), "mass": 1.0, "inertia": (0.1, 0.0, 0.0, 0.1, 0.0, 0.3)}, "sum of the other two"),
        ({"geometry": Sphere(0.1), "mass": 1.0, "inertia": (0.1, 0.2, 0.0, 0.1, 0.0, 0.1)}, "impossible inertia"),
        ({"geometry": Sphere(0.1), "twist": ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))}, "no mass"),
    ],
)
def test_a_body_that_contradicts_itself_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Body(**fields)


def test_an_inertia_is_six_finite_numbers() -> None:
    with pytest.raises(ParameterValueError, match="finite"):
        Body(geometry=Sphere(0.1), mass=1.0, inertia=(float("nan"), 0.0, 0.0, 0.1, 0.0, 0.1))


def test_a_body_weighs_what_collides_of_it_unless_it_says_otherwise() -> None:
    shapes = Shape(Box((1.0, 1.0, 1.0))), Shape(Box((1.0, 1.0, 1.0)), Pose((1.0, 0.0, 0.0)), collides=False)
    block = Body(shapes=shapes, density=2.0).inertial
    assert block is not None
    assert (block.mass, block.origin.pos) == (pytest.approx(2.0), pytest.approx((0.0, 0.0, 0.0)))
    ghost = Body(shapes=shapes, density=2.0, collides=False).inertial
    assert ghost is not None
    assert (ghost.mass, ghost.origin.pos) == (pytest.approx(4.0), pytest.approx((0.5, 0.0, 0.0)))
    given = Body(shapes=shapes, mass=3.0, center_of_mass=(0.0, 0.0, 0.1), inertia=MOMENTS).inertial
    assert given is not None
    assert (given.mass, given.origin.pos, given.inertia) == (3.0, (0.0, 0.0, 0.1), MOMENTS)
    assert Body(shapes=shapes).inertial is None


def test_the_shapes_of_a_body_take_what_they_omit_from_it() -> None:
    red, grey = (1.0, 0.0, 0.0, 1.0), (0.5, 0.5, 0.5, 1.0)
    body = Body(shapes=(Shape(Sphere(0.1), rgba=red), Shape(Sphere(0.2), collides=False)), rgba=grey)
    assert [(part.rgba, part.collides) for part in body.parts] == [(red, True), (grey, False)]
    assert [shape.geometry for shape in body.collisions] == [Sphere(0.1)]
    assert not Body(geometry=Sphere(0.1), collides=False).collisions


def test_an_attachment_keeps_the_relative_pose_at_reset_unless_it_gives_another() -> None:
    half = 0.5**0.5
    bodies = {
        "first": Body(geometry=Sphere(0.1), pose=Pose((1.0, 0.0, 0.0), (half, 0.0, 0.0, half))),
        "second": Body(geometry=Sphere(0.1), mass=1.0, pose=Pose((1.0, 0.5, 0.2))),
    }
    given = Pose((0.0, 0.0, 0.3))
    attachments = {"as_they_stand": Attachment("first", "second"), "given": Attachment("first", "second", given)}
    scene = Scene(bodies=bodies, attachments=attachments)
    scene.check({})
    found = scene.attachment_pose("as_they_stand", {})
    assert found.pos == pytest.approx((0.5, 0.0, 0.2))
    assert found.quat_wxyz == pytest.approx((half, 0.0, 0.0, -half))
    assert scene.attachment_pose("given", {}) == given


@pytest.mark.parametrize(
    ("first", "second"), [("ball", "ball"), ("ball", "wall"), ("ball", "floor"), ("robot", "ball")]
)
def test_an_attachment_needs_two_sides_of_which_the_second_moves(first: str, second: str) -> None:
    bodies = {"ball": Body(geometry=Sphere(0.1), mass=1.0), "wall": Body(geometry=Sphere(0.1))}
    with pytest.raises(SceneError, match="attachment 'weld'"):
        Scene(bodies=bodies, attachments={"weld": Attachment(first, second)}).check({})


@pytest.mark.parametrize("simulator", ["mujoco", "pybullet"])
def test_a_box_slides_by_the_larger_of_two_frictions(simulator: str) -> None:
    subject = SimulatorUnderTest(frobs_core.plugins.get_record("simulator", simulator))
    box = Body(
        geometry=Box((0.2, 0.2, 0.1)),
        pose=Pose((0.0, 3.0, 0.05)),
        twist=((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        mass=1.0,
        friction=0.5,
    )
    with subject.build(bodies={"box": box}, floor_friction=0.6, num_envs=1) as (simulation, _):
        simulation.step(100)  # 0.2 s
        speed = simulation.bodies["box"].twist[0][0, 0]
        assert speed == pytest.approx(2.0 - 0.2 * 9.81 * 0.6, abs=0.05)
        assert simulation.parameter("friction", "floor") == pytest.approx(0.6)

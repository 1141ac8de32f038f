"""Checks of scene bodies: shapes, masses and motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from frobs_core.description import AT_REST, Attachment, Body, Prop, Shape
from frobs_core.models import Box, Mesh, Pose, Sphere, inertia_matrix
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SceneError, SimulationError
from frobs_core.util.rotations import matrix_from_quat, quat_conjugate, quat_multiply, quat_rotate
from frobs_devkit.testing.checks import NotApplicable, after, expect, expect_raises
from frobs_devkit.testing.compare import expect_close, expect_same_pose
from frobs_devkit.testing.simulator.robots import LIFT
from frobs_devkit.testing.simulator.under_test import (
    BALL,
    BAR,
    TILTED,
    TIMESTEP,
    WEIGHTLESS,
    SimulatorUnderTest,
    verifies,
)
from frobs_models import MeshPart, write_stl

_QUARTER_TURN = (0.5**0.5, 0.0, 0.0, 0.5**0.5)  # about z
_TWIST = (0.3, -0.2, 0.1), (1.0, 2.0, -3.0)
_HAMMER = Body(
    shapes=(
        Shape(Box((0.3, 0.04, 0.04)), Pose((0.1, 0.0, 0.0))),
        Shape(Box((0.06, 0.2, 0.06)), Pose((0.25, 0.02, 0.0))),
    ),
    pose=TILTED,
    twist=_TWIST,
    mass=0.7,
)
"""A body whose center of mass is 19 cm from its origin and whose principal axes differ from its frame axes."""


_BOX = Body(
    geometry=Box((0.1, 0.1, 0.1)),
    pose=Pose(
        tuple((TILTED.pos + quat_rotate(np.array(TILTED.quat_wxyz), np.array([0.2, 0.0, 0.1]))).tolist()),
        TILTED.quat_wxyz,
    ),
    mass=1.0,
)
"""A box whose pose relative to a ball at :data:`TILTED` is the pose at which ``attachments_hold`` attaches it."""


@verifies("teleport")
def bodies_are_thrown(subject: SimulatorUnderTest) -> None:
    """Free bodies start with the twist from the scene and accept a new twist. Other bodies reject a twist."""
    with subject.build(
        bodies={"ball": replace(BALL, pose=TILTED, twist=_TWIST), "bar": BAR}, gravity=WEIGHTLESS, floor=False
    ) as (sim, _):
        n, ball = sim.num_envs, sim.bodies["ball"]
        for name, expected, actual in zip(("lin_vel_world", "ang_vel_world"), _TWIST, ball.twist, strict=True):
            subject.expect_each(expected, actual, 1e-6, f"{name} of a ball at reset")
        sim.step(100)
        flown = np.array(TILTED.pos) + 100 * TIMESTEP * np.array(_TWIST[0])
        subject.expect_each(flown, ball.pose[0], 1e-6, "position of a ball that starts with a twist [m]")
        mask = np.arange(n) == 0
        ball.write_twist(np.array([[0.0, 1.0, 0.5]]), np.array([[-1.0, 0.0, 4.0]]), mask)
        for name, expected, written, actual in zip(
            ("lin_vel_world", "ang_vel_world"), _TWIST, ((0.0, 1.0, 0.5), (-1.0, 0.0, 4.0)), ball.twist, strict=True
        ):
            expect_close(
                np.where(mask[:, None], written, expected), actual, 1e-6, f"{name} after write_twist in environment 0"
            )
        sim.reset(mask)
        expect_close(np.array(_TWIST[0]), ball.twist[0][0], 1e-6, "lin_vel_world of a ball after a second reset")
        with expect_raises(SimulationError, "write_twist on a kinematic body"):
            sim.bodies["bar"].write_twist(np.zeros((n, 3)), np.zeros((n, 3)))


@verifies("wrench")
@after("wrenches_push")
def compound_bodies_move(subject: SimulatorUnderTest) -> None:
    """A body with two shapes rotates about its center of mass, but its pose and twist refer to its origin."""
    inertial = _HAMMER.inertial
    assert inertial is not None
    turn = matrix_from_quat(np.array(TILTED.quat_wxyz))
    with subject.build(bodies={"hammer": _HAMMER}, gravity=WEIGHTLESS, floor=False) as (sim, _):
        n, hammer = sim.num_envs, sim.bodies["hammer"]
        subject.expect_each(TILTED.pos, hammer.pose[0], 1e-9, "the hammer's position [m]")
        subject.expect_each(_TWIST[0], hammer.twist[0], 1e-6, "lin_vel_world of the hammer's origin at reset")
        before = hammer.pose[0].copy()
        sim.step(1)
        subject.expect_each(_TWIST[0], (hammer.pose[0] - before) / TIMESTEP, 0.02, "motion of the hammer's origin")
        if subject.level("teleport"):
            hammer.write_pose(np.tile(TILTED.pos, (n, 1)), np.tile(TILTED.quat_wxyz, (n, 1)))
            subject.expect_each(TILTED.pos, hammer.pose[0], 1e-9, "the hammer's written position [m]")
            force, torque = np.array([1.0, -0.5, 0.3]), np.array([1e-3, 2e-3, -1e-3])
            sim.apply_wrench("hammer", force[None], torque[None])
            sim.step(1)
            spin = np.linalg.solve(turn @ inertia_matrix(inertial) @ turn.T, torque) * TIMESTEP
            speed = force * TIMESTEP / inertial.mass - np.cross(spin, turn @ inertial.origin.pos)
            tolerance = subject.tolerance("wrench", exact=1e-6)
            subject.expect_each(spin, hammer.twist[1], tolerance, "ang_vel_world of a hammer after applying a torque")
            subject.expect_each(
                speed, hammer.twist[0], tolerance, "lin_vel_world of a hammer's origin after applying a force"
            )


@verifies("attachments")
def attachments_hold(subject: SimulatorUnderTest) -> None:
    """A body that is attached to a moving link or a moving body keeps its relative pose."""
    hammer = replace(_HAMMER, pose=Pose((0.6, 0.3, 0.9), _QUARTER_TURN), twist=AT_REST, collides=False)
    bodies = {"hammer": hammer, "ball": replace(BALL, pose=TILTED), "box": replace(_BOX, twist=_TWIST)}
    attachments = {
        "held": Attachment("robot/table", "hammer"),
        "pair": Attachment("ball", "box", Pose((0.2, 0.0, 0.1))),
    }
    with subject.build(LIFT, bodies=bodies, attachments=attachments, gravity=WEIGHTLESS, floor=False) as (sim, robot):
        n = sim.num_envs
        places: dict[str, tuple[Callable[[], tuple[Floats, Floats]], str]] = {
            "pose of the hammer relative to the table": (lambda: robot.frame_pose("table"), "hammer"),
            "pose of the box relative to the ball": (lambda: sim.bodies["ball"].pose, "box"),
        }
        held = _relative(robot.frame_pose("table"), sim.bodies["hammer"].pose)
        fixed = np.tile([0.2, 0.0, 0.1], (n, 1)), np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        expected = dict(zip(places, (held, fixed), strict=True))
        robot.command(np.tile([0.1, 0.5], (n, 1)))
        for _ in range(2):
            sim.step(200)
            for what, (frame, body) in places.items():
                actual = _relative(frame(), sim.bodies[body].pose)
                expect_same_pose(expected[what], actual, subject.tolerance("attachments", 1e-3, 0.01), what)
        expect(
            (np.abs(robot.joint_positions[:, 1]) > 0.2).all(),
            "the table with the attached body did not turn as commanded.",
        )
        speed = np.linalg.norm(sim.bodies["ball"].twist[0], axis=1)
        expect(
            (speed > 0.05).all(),
            f"a ball that is attached to a moving box must move, but its speed is only {speed} m/s.",
        )


def _relative(frame: tuple[Floats, Floats], pose: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return a pose relative to a frame, as position (n, 3) [m] and quat_wxyz (n, 4)."""
    back = quat_conjugate(frame[1])
    return quat_rotate(back, pose[0] - frame[0]), quat_multiply(back, pose[1])


@verifies("wrench")
def props_give_way(subject: SimulatorUnderTest) -> None:
    """A drawer opens against its joint damping when its handle is pulled, and otherwise stays at rest."""
    model = str(Path(__file__).with_name("urdf") / "kit_drawer.urdf")
    prop = Prop(model=model, pose=Pose((1.0, 0.0, 0.0), _QUARTER_TURN))
    pull, mass, damping, steps = 4.0, 2.5, 8.0, 100
    with subject.build(props={"drawer": prop}) as (sim, _):
        n, drawer = sim.num_envs, sim.robots["drawer"]
        sim.step(steps)
        subject.expect_each(np.zeros(1), drawer.joint_positions, 1e-4, "position of a drawer that is not pulled [m]")
        mask, position, speed = np.arange(n) == 0, 0.0, 0.0
        before = drawer.frame_pose("handle")[0].copy()
        for _ in range(steps):
            sim.apply_wrench("drawer/handle", np.array([[0.0, pull, 0.0]]), np.zeros((1, 3)), mask)
            sim.step(1)
            speed = (speed + TIMESTEP * pull / mass) / (1.0 + TIMESTEP * damping / mass)  # with implicit damping
            position += TIMESTEP * speed
        expected = np.where(mask, position, 0.0)
        tolerance = 0.02 * position
        expect_close(expected[:, None], drawer.joint_positions, tolerance, "position of a drawer that is pulled [m]")
        moved = (drawer.frame_pose("handle")[0] - before)[:, 1]
        expect_close(expected, moved, tolerance, "motion of the handle along the world's y axis [m]")
        sim.reset()
        subject.expect_each(np.zeros(1), drawer.joint_positions, 1e-6, "position of the drawer after a reset [m]")


@verifies("rays")
def every_shape_is_met(subject: SimulatorUnderTest) -> None:
    """Rays hit all colliding shapes of a body, including meshes, and pass through shapes that do not collide."""
    with TemporaryDirectory() as folder:
        wedge = Path(folder, "wedge.stl")
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
        faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
        write_stl(MeshPart(corners, faces), wedge)
        shapes = (
            Shape(Box((0.2, 0.2, 0.2)), Pose((0.0, 0.0, 0.1))),
            Shape(Mesh(wedge, (0.4, 0.4, 0.4)), Pose((1.0, 0.0, 0.0))),
            Shape(Sphere(0.4), Pose((0.0, 0.0, 0.5)), collides=False),
        )
        with subject.build(bodies={"pile": Body(shapes=shapes, pose=Pose((0.0, 2.0, 0.0)))}) as (sim, _):
            n = sim.num_envs
            origins = np.tile([[0.0, 2.0, 2.0], [1.1, 2.1, 2.0], [2.0, 2.0, 2.0]], (n, 1, 1))
            lengths = sim.rays(origins, np.tile([0.0, 0.0, -1.0], (n, 3, 1)), 5.0)
    tolerance = max(1e-3, subject.tolerance("rays"))
    subject.expect_each([1.8, 1.8, 2.0], lengths, tolerance, "lengths of rays down to a box, a mesh and the floor [m]")


@verifies("contacts")
def boxes_slide(subject: SimulatorUnderTest) -> None:
    """A box that slides on a floor with the same friction loses speed at the rate of friction times gravity."""
    time = 0.2  # [s]
    for friction in (0.2, 0.4):
        box = Body(
            geometry=Box((0.2, 0.2, 0.1)),
            pose=Pose((0.0, 2.0, 0.05)),
            twist=((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            mass=1.0,
            friction=friction,
        )
        with subject.build(bodies={"box": box}, floor_friction=friction, num_threads=1) as (sim, _):
            sim.step(round(time / TIMESTEP))
            lost = np.full(sim.num_envs, friction * 9.81 * time)
            what = f"speed that a sliding box with a friction of {friction} loses in {time} s [m/s]"
            expect_close(lost, 1.0 - sim.bodies["box"].twist[0][:, 0], 0.2 * float(lost[0]), what)


@verifies("contacts")
def frictions_brake(subject: SimulatorUnderTest) -> None:
    """Torsional and rolling friction slow down a ball on the floor, unless the simulator rejects such friction."""
    lying = replace(BALL, pose=Pose((0.0, 2.0, 0.05)))
    inertia, load = 0.4 * 0.5 * 0.05**2, 0.5 * 9.81
    spinning = replace(lying, twist=((0.0, 0.0, 0.0), (0.0, 0.0, 20.0)))
    rolling = replace(lying, twist=((1.0, 0.0, 0.0), (0.0, 20.0, 0.0)))
    cases: dict[str, tuple[Body, float, Callable[[float], float]]] = {
        "torsional_friction": (spinning, 0.005, lambda friction: friction * load / inertia),
        "rolling_friction": (rolling, 0.005, lambda friction: friction * load / (3.5 * inertia)),
    }
    refused = []
    for name, (body, friction, brake) in cases.items():
        for value in (0.0, friction):
            try:
                with subject.build(bodies={"ball": replace(body, **{name: value})}) as (sim, _):  # type: ignore[arg-type]
                    sim.step(100)
                    speed = np.linalg.norm(sim.bodies["ball"].twist[1], axis=1)
            except SceneError:
                expect(value > 0.0, f"a body with a {name} of 0 is rejected.")
                refused.append(name)
                continue
            lost = 100 * TIMESTEP * brake(value)
            subject.expect_each(20.0 - lost, speed, 0.5, f"speed of a ball with a {name} of {value} m")
    if len(refused) == len(cases):
        raise NotApplicable("the simulator rejects torsional and rolling friction")

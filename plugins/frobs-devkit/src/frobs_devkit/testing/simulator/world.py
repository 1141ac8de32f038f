"""Checks of scene features: bodies, rays, contacts, wrenches and cameras."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.description import Camera, Contact, Lidar, Marker
from frobs_core.models import Pose
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_devkit.testing.checks import NotApplicable, expect, expect_raises
from frobs_devkit.testing.compare import expect_array, expect_close
from frobs_devkit.testing.simulator.robots import LIFT, ROVER
from frobs_devkit.testing.simulator.under_test import (
    BALL,
    BAR,
    TILTED,
    TIMESTEP,
    WALL,
    WEIGHTLESS,
    SimulatorUnderTest,
    verifies,
)

_ON_FLOOR = replace(BALL, pose=Pose(pos=(0.0, 2.0, 0.05)))
_QUARTER_TURN = np.array([[0.5**0.5, 0.0, 0.0, 0.5**0.5]])  # about z


@verifies("teleport")
def bodies_are_placed(subject: SimulatorUnderTest) -> None:
    """A body starts at its pose in the scene, and a new pose moves it only in the environments selected by the mask."""
    with subject.build(bodies={"ball": replace(BALL, pose=TILTED), "bar": BAR}) as (sim, _):
        n = sim.num_envs
        ball = sim.bodies["ball"]
        subject.expect_each(TILTED.pos, ball.pose[0], 1e-9, "the ball's position [m]")
        subject.expect_each(TILTED.quat_wxyz, ball.pose[1], 1e-9, "the ball's quat_wxyz")
        sim.step(10)
        falling = ball.twist[0].copy()
        expect((falling[:, 2] < -0.1).all(), f"a free ball does not fall: lin_vel_world is {falling}.")
        mask = np.arange(n) == 0
        ball.write_pose(np.array([[0.5, 0.6, 0.7]]), mask=mask)
        expect_close(np.array([0.5, 0.6, 0.7]), ball.pose[0][0], 1e-9, "the ball's written position [m]")
        expect_close(
            np.array(TILTED.quat_wxyz), ball.pose[1][0], 1e-6, "quat_wxyz of a body after writing only its position"
        )
        expect_close(np.zeros(3), ball.twist[0][0], 0.0, "lin_vel_world of the moved ball")
        expect_close(falling[1:], ball.twist[0][1:], 0.0, "lin_vel_world of the other balls")
        turned = _QUARTER_TURN.repeat(n, axis=0)
        ball.write_pose(np.tile([0.5, 0.6, 0.7], (n, 1)), turned)
        expect_close(turned, ball.pose[1], 1e-9, "quat_wxyz of the rotated balls")
        bar = sim.bodies["bar"]
        bar.write_pose(np.array([[0.0, -2.0, 1.0]]))
        sim.step(10)
        subject.expect_each([0.0, -2.0, 1.0], bar.pose[0], 1e-9, "written position of a kinematic body [m]")
        places = np.array([[[0.1, -2.5, 1.5], [0.4, 0.5, 1.2]]])
        before = {name: body.pose[0].copy() for name, body in sim.bodies.items()}
        sim.write_body_poses(("bar", "ball"), places, np.tile(_QUARTER_TURN, (1, 2, 1)), mask)
        for number, name in enumerate(("bar", "ball")):
            what = f"position of body '{name}', after write_body_poses in environment 0 [m]"
            expect_close(np.where(mask[:, None], places[:, number], before[name]), sim.bodies[name].pose[0], 1e-9, what)
            what = f"quat_wxyz of body '{name}' in environment 0, after write_body_poses"
            expect_close(_QUARTER_TURN[0], sim.bodies[name].pose[1][0], 1e-9, what)


@verifies("rays")
def rays_measure(subject: SimulatorUnderTest) -> None:
    """Rays return the distance to a wall or to a moved and rotated body, or ``max_range`` if they hit nothing."""
    tolerance = subject.tolerance("rays", exact=1e-6)
    with subject.build(bodies={"wall": WALL, "bar": BAR}) as (sim, _):
        n = sim.num_envs
        directions = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 1.0, 0], [0, 0, -1.0], [0.8, 0.6, 0]])
        origins = np.tile([0.0, 0.0, 1.0], (n, 5, 1))
        expected = np.array([1.9, 2.95, 10.0, 1.0, 1.9 / 0.8])
        lengths = sim.rays(origins, np.tile(directions, (n, 1, 1)), 10.0)
        subject.expect_each(
            expected, lengths, tolerance, "lengths of rays to a wall, a bar, nothing, the floor and a slanted wall [m]"
        )
        if subject.level("teleport"):
            y = -3.0 - 0.5 * np.arange(n)
            places = np.stack([np.zeros(n), y, np.ones(n)], axis=-1)
            sim.bodies["bar"].write_pose(places, np.repeat(_QUARTER_TURN, n, axis=0))
            lengths = sim.rays(origins[:, :1], np.tile(directions[1:2], (n, 1, 1)), 10.0)
            expect_close(
                -y[:, None] - 0.5, lengths, tolerance, "lengths of rays to the bar after it was moved and rotated [m]"
            )
        lengths = sim.rays(origins[:, :1], np.tile(directions[:1], (n, 1, 1)), 1.0)
        subject.expect_each(np.ones(1), lengths, 0.0, "length of a ray whose max_range ends before the wall [m]")


@verifies("rays")
def lidars_measure(subject: SimulatorUnderTest) -> None:
    """A lidar rotates with its link, scans counterclockwise, respects its range, and does not detect its own robot."""
    lidar = Lidar(frame="hull", rays=3, angle_min=-0.5 * np.pi, angle_max=0.5 * np.pi, range_min=0.2, range_max=6.0)
    bodies = {"wall": WALL, "bar": replace(BAR, pose=Pose(pos=(0.0, -3.0, 0.05)))}
    seeing = replace(ROVER, sensors={"scan": lidar})
    with subject.build(seeing, bodies=bodies, pose=Pose(pos=(0.0, 0.0, 0.05))) as (sim, robot):
        n = sim.num_envs
        tolerance = subject.tolerance("rays", exact=1e-6)
        subject.expect_each([2.95, 1.9, 6.0], robot.lidar("scan"), tolerance, "lidar: bar, wall, nothing [m]")
        if subject.level("teleport"):
            robot.write_base_pose(np.array([[0.0, 0.0, 0.05]]).repeat(n, axis=0), _QUARTER_TURN.repeat(n, axis=0))
            ranges = robot.lidar("scan")
            subject.expect_each(
                [1.9, 6.0, 6.0], ranges, tolerance, "lidar readings of a robot that was rotated to the left [m]"
            )
            robot.write_base_pose(np.array([[1.8, 0.0, 0.05]]).repeat(n, axis=0), _QUARTER_TURN.repeat(n, axis=0))
            subject.expect_each(
                0.2, robot.lidar("scan")[:, 0], tolerance, "lidar readings of objects closer than range_min [m]"
            )
        with expect_raises(UnknownNameError, "lidar('no_such_lidar')"):
            robot.lidar("no_such_lidar")


@verifies("rays")
def rays_exclude_a_robot(subject: SimulatorUnderTest) -> None:
    """Rays hit a robot unless ``exclude`` names it, and ``exclude`` rejects names of robots that do not exist."""
    with subject.build(ROVER, pose=Pose(pos=(0.0, 0.0, 0.05))) as (sim, robot):
        n = sim.num_envs
        origins, down = np.tile([0.0, 0.0, 2.0], (n, 1, 1)), np.tile([0.0, 0.0, -1.0], (n, 1, 1))
        hit = sim.rays(origins, down, 5.0)
        expect(
            (hit < 1.99).all(), f"a ray from above hits the floor instead of the robot: its length is {hit.max():.3f} m"
        )
        expect_close(
            np.full((n, 1), 2.0),
            sim.rays(origins, down, 5.0, exclude=robot.name),
            subject.tolerance("rays", exact=1e-6),
            "length of a ray to the floor below the excluded robot [m]",
        )
        with expect_raises(UnknownNameError, "rays(…, exclude='no_such_robot')"):
            sim.rays(origins, down, 5.0, exclude="no_such_robot")


@verifies("contacts")
def contacts_are_told(subject: SimulatorUnderTest) -> None:
    """Declared contacts and their forces are reported for the whole step and for each environment.

    Undeclared contacts raise UnknownNameError.
    """
    contacts = {"landed": Contact(first="ball", second="floor"), "any": Contact(first="floor")}
    with subject.build(bodies={"ball": _ON_FLOOR}, contacts=contacts) as (sim, _):
        n = sim.num_envs
        sim.step(400)
        for name in contacts:
            expect(
                sim.contact(name).all(),
                f"contact('{name}') is {sim.contact(name)} for a ball on the floor; expected True.",
            )
        subject.expect_each(0.5 * 9.81, sim.contact_force("landed"), 1.0, "contact_force of the ball's weight [N]")
        if subject.level("wrench"):
            lifted = np.arange(n) == 0
            sim.apply_wrench("ball", np.array([[0.0, 0.0, 60.0]]), np.zeros((1, 3)), lifted)
            sim.step(40)
            expect(sim.bodies["ball"].pose[0][0, 2] > 0.1, "the wrench did not lift the ball.")
            expect(
                sim.contact("landed")[0], "a contact at the beginning of a step is not reported at the end of the step."
            )
            sim.step(5)
            touching = sim.contact("landed")
            expect(not touching[0], "a contact is reported for a ball in the air.")
            expect(
                touching[1:].all(),
                f"contacts are reported for the wrong environments: {touching}; only the ball of environment 0 is in the "
                "air.",
            )
            expect_close(0.0, sim.contact_force("landed")[0], 0.0, "contact_force of a ball in the air [N]")
        with expect_raises(UnknownNameError, "contact('no_such_contact')"):
            sim.contact("no_such_contact")


@verifies("wrench")
def wrenches_push(subject: SimulatorUnderTest) -> None:
    """A wrench acts for exactly one step, and changes the velocity of a body or link by F·t/m and τ·t/I."""
    tolerance = subject.tolerance("wrench", exact=1e-6)
    force, torque = np.array([[1.0, -0.5, 0.3]]), np.array([[1e-3, 2e-3, -1e-3]])
    built = subject.build(LIFT, mode=CommandMode.EFFORT, bodies={"ball": BALL}, gravity=WEIGHTLESS, floor=False)
    with built as (sim, robot):
        n = sim.num_envs
        mask = np.arange(n) == 0
        sim.apply_wrench("ball", force, torque, mask)
        sim.apply_wrench("robot/table", np.array([[0.0, 0.0, 3.0]]), np.array([[0.0, 0.0, 0.03]]), mask)
        for when in ("in the step of a wrench", "in the step after it"):
            sim.step(10)
            t = 10 * TIMESTEP
            pushed = mask[:, None]
            expect_close(pushed * force * t / 0.5, sim.bodies["ball"].twist[0], tolerance, f"velocity {when} [m/s]")
            inertia = 0.4 * 0.5 * 0.05**2
            expect_close(pushed * torque * t / inertia, sim.bodies["ball"].twist[1], tolerance, f"ang_vel_world {when}")
            expect_close(pushed * np.full(2, t), robot.joint_velocities, tolerance, f"joint velocities {when}")


@verifies("cameras")
def cameras_see(subject: SimulatorUnderTest) -> None:
    """Every modality has the correct shape and dtype, with one non-empty image for each selected environment."""
    shapes = {"rgb": (np.uint8, 3), "depth": (np.float32, 1), "segmentation": (np.int32, 1)}
    with subject.build(bodies={"wall": WALL, "bar": BAR}) as (sim, _):
        mask = np.arange(sim.num_envs) == 0
        for modality in sim.render_modalities:
            picture = sim.render(mask, None, (48, 64), modality)
            dtype, channels = shapes[modality]
            expect_array(picture, (1, 48, 64, channels), dtype, f"render('{modality}')")
            expect(len(np.unique(picture)) > 1, f"render('{modality}') only contains the value {picture.flat[0]}.")
        picture = sim.render(None, None, (48, 64))
        expect(
            len(picture) == sim.num_envs,
            f"render() of all {sim.num_envs} environments returns {len(picture)} images.",
        )
        for arguments in ({"camera": "no_such_camera"}, {"modality": "no_such_modality"}):
            with expect_raises(UnknownNameError, f"render({arguments})"):
                sim.render(mask, size=(48, 64), **arguments)  # type: ignore[arg-type]


@verifies("cameras")
def depth_is_in_metres(subject: SimulatorUnderTest) -> None:
    """Cameras in the world and on a link measure the distance to a wall, and render a marker in front of the wall."""
    cameras = {
        "world": Camera(pos=(0.0, 1.0, 1.0), target=(2.0, 1.0, 1.0)),
        "link": Camera(pos=(0.1, 0.0, 1.0), target=(1.0, 0.0, 1.0), frame="robot/base"),
    }
    with subject.build(bodies={"wall": WALL}, cameras=cameras, num_envs=1) as (sim, _):
        for name, distance in (("world", 1.9), ("link", 1.8)):
            depth = sim.render(None, name, (48, 64), "depth")
            expect_close(distance, depth[0, 24, 32, 0], 0.02, f"depth of a wall from the camera on the {name} [m]")
        red = [Marker(np.array([[1.0, 1.0, 1.0]]), 0.2, (1.0, 0.0, 0.0, 1.0))]
        plain, marked = (sim.render(None, "world", (48, 64), markers=m)[0, 24, 32].astype(int) for m in ((), red))
        expect(
            marked[0] - marked[2] > plain[0] - plain[2] + 50,
            f"a red marker in front of the wall is not visible: the pixel is {marked} with the marker and "
            f"{plain} without the marker.",
        )


def contradictions_are_refused(subject: SimulatorUnderTest) -> None:
    """A scene that is inconsistent or refers to missing objects raises a ConfigurationError."""
    camera = Camera(pos=(1.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), frame="robot/no_such_link")
    upright = Camera(pos=(1.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), up=(2.0, 0.0, 0.0))
    scenes: dict[str, dict[str, Any]] = {
        "a body that is kinematic and has a mass": {"bodies": {"x": replace(BALL, kinematic=True)}},
        "a contact of no body": {"contacts": {"c": Contact(first="no_such_body")}},
        "a camera on no link": {"cameras": {"c": camera}},
        "a camera whose up vector is parallel to its viewing direction": {"cameras": {"c": upright}},
    }
    for what, scene in scenes.items():
        # a simulator that rejects every free body rejects this scene too
        refusals = (ConfigurationError, NotApplicable)
        with expect_raises(refusals, f"a scene with {what}"), subject.build(**scene):
            pass

"""Checks of rendered images, and of parameters that change only images."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.contracts import Simulation
from frobs_core.description import Body, Camera, Intrinsics
from frobs_core.models import Box, Pose
from frobs_core.util.arrays import Mask
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_devkit.testing.checks import after, expect, expect_raises
from frobs_devkit.testing.compare import expect_array, expect_close
from frobs_devkit.testing.simulator.under_test import WALL, SimulatorUnderTest, verifies

_RED = Body(geometry=Box((0.1, 0.2, 0.2)), pose=Pose(pos=(1.5, 0.5, 1.4)), rgba=(1.0, 0.0, 0.0, 1.0), kinematic=True)
_BOX = Body(geometry=Box((0.1, 0.4, 0.4)), pose=Pose(pos=(1.5, 0.3, 1.2)), rgba=(0.5, 0.5, 0.5, 1.0), kinematic=True)
_CAMERA = Camera(pos=(0.0, 0.0, 1.0), target=(1.0, 0.0, 1.0))
_ABOVE = Camera(pos=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), fov_y=60.0)
_ROLLED = replace(_CAMERA, up=(0.0, 1.0, 0.0))
_SIZE = (48, 64)
_ALIKE = 0.98  # minimum share of pixels that two equal images have in common


@verifies("cameras")
def pictures_are_true(subject: SimulatorUnderTest) -> None:
    """A red box has the correct position, color and segmentation ID, and a rolled camera rotates the image."""
    cameras = {"front": _CAMERA, "rolled": _ROLLED}
    with subject.build(bodies={"wall": WALL, "red": _RED}, cameras=cameras, num_threads=1) as (sim, _):
        mask = np.arange(sim.num_envs) == 0
        shown = [one for one in sim.render_modalities if one != "depth"]  # depth_is_in_metres checks depth images
        drawn = {modality: sim.render(mask, "front", _SIZE, modality)[0] for modality in shown}
        rolled = _red(sim.render(mask, "rolled", _SIZE)[0])
        red = _red(drawn["rgb"])  # (h, w)
        expect(red.any(), "no pixel of the image is red, although a red box is in front of the camera.")
        up, left = np.argwhere(red).mean(0)
        expect(
            up < 20 and left < 24, f"the red box is rendered at row {up:.0f}, column {left:.0f}, not at the upper left."
        )
        expect(
            rolled.any(),
            "no pixel of the image is red, although a red box is in front of a camera whose up vector is the y axis.",
        )
        up, right = np.argwhere(rolled).mean(0)
        where = f"at row {up:.0f}, column {right:.0f}"
        expect(
            up < 20 and right > 40,
            f"with the y axis as up vector, the red box is rendered {where}, not at the upper right.",
        )
        if "segmentation" in drawn:
            numbers = drawn["segmentation"][..., 0]
            (values, counts) = np.unique(numbers[red], return_counts=True)
            own = values[counts.argmax()]
            expect(counts.max() >= 0.7 * red.sum(), f"the red box has several segmentation IDs: {values}.")
            expect(own != numbers[24, 32], f"the red box and the wall have the same segmentation ID, {own}.")


@verifies("camera_intrinsics")
@after("pictures_are_true")
def intrinsics_project_points(subject: SimulatorUnderTest) -> None:
    """A red box appears at the pixel to which the camera's intrinsics project it, in images of two sizes."""
    x, y, z = (1.5, 0.5, 1.4)  # [m] in front of, to the left of and above the origin
    lens = Intrinsics(fx=90.0, fy=70.0, cx=45.0, cy=30.0, width=64, height=48)
    column, row = lens.fx * -y / x + lens.cx, lens.fy * (1.0 - z) / x + lens.cy
    box = replace(_RED, geometry=Box((0.02, 0.1, 0.1)), pose=Pose(pos=(x, y, z)))
    with subject.build(bodies={"red": box}, cameras={"front": replace(_CAMERA, intrinsics=lens)}) as (sim, _):
        for scale in (1, 2):
            shown = _red(sim.render(None, "front", (48 * scale, 64 * scale))[0])
            expect(shown.any(), "no pixel of the image is red, although a red box is in front of the camera.")
            expected = scale * np.array([row + 0.5, column + 0.5]) - 0.5
            what = f"row and column of a red box in an image of {48 * scale} × {64 * scale} pixels"
            expect_close(expected, np.argwhere(shown).mean(axis=0), 0.75 * scale, what)


@verifies("cameras")
@after("pictures_are_true")
def fast_pictures_show_the_same(subject: SimulatorUnderTest) -> None:
    """For each environment and image size, a fast image shows the same objects in the same places as a full image."""
    with subject.build(bodies={"wall": WALL, "red": _RED}, cameras={"front": _CAMERA}) as (sim, _):
        n = sim.num_envs
        if subject.level("teleport"):
            places = np.tile(_RED.pose.pos, (n, 1))
            places[:, 2] -= 0.3 * np.arange(n)
            sim.bodies["red"].write_pose(places)
        all_drawn = sim.render(None, "front", _SIZE, fast=True)
        for size in ((84, 84), (48, 64), (84, 84)):
            full, fast = (sim.render(None, "front", size, fast=only_fast) for only_fast in (False, True))
            expect_array(fast, (n, *size, 3), np.uint8, "render(fast=True)")
            for i in range(n):
                expect(
                    _red(fast[i]).any(),
                    f"no pixel of a fast {size} image is red, although a red box is in front of the camera.",
                )
                shown, expected = (np.argwhere(_red(one[i])).mean(axis=0) for one in (fast, full))
                what = f"row and column of a red box in a fast {size} image of environment {i}"
                expect_close(expected, shown, 2.0, what)
        if subject.level("teleport"):
            rows = [np.argwhere(_red(one))[:, 0].mean() for one in all_drawn]
            lower = np.diff(rows) > 2.0  # each box is lower than the previous environment's box
            expect(
                lower.all(),
                f"red boxes, each lower than the previous box, are rendered at the image rows {rows}, which must "
                "increase.",
            )
        for mask in (np.arange(n) == n - 1, np.zeros(n, np.bool_)):
            some = sim.render(mask, "front", _SIZE, fast=True)
            expect_array(some, (int(mask.sum()), *_SIZE, 3), np.uint8, f"render of the mask {mask}")
            for i, image in zip(np.flatnonzero(mask).tolist(), some, strict=True):
                shown, expected = (np.argwhere(_red(one)).mean(axis=0) for one in (image, all_drawn[i]))
                expect_close(
                    expected, shown, 2.0, f"row and column of a red box in environment {i}, rendered with a mask"
                )


def _red(rgb: np.ndarray[Any, Any]) -> Mask:
    red, green, blue = np.moveaxis(rgb.astype(np.int64), -1, 0)
    mask: Mask = (red > 90) & (green < 0.6 * red) & (blue < 0.6 * red)
    return mask


@verifies("randomize_looks")
@after("pictures_are_true")
def colors_and_light_show(subject: SimulatorUnderTest) -> None:
    """In each environment, a box has the color and the scene has the light that are set for that environment."""
    with subject.build(bodies={"box": _BOX}, cameras={"front": _CAMERA}) as (sim, _):
        n = sim.num_envs
        subject.expect_each([0.5, 0.5, 0.5], sim.parameter("color", "box"), 1e-6, "color of a gray box")
        channels = np.arange(n) % 3
        sim.write_parameter("color", "box", np.eye(3)[channels])
        pictures = sim.render(None, "front", _SIZE).astype(int)
        for i, picture in enumerate(pictures):
            colorful = np.ptp(picture, axis=2) > 80
            expect(colorful.any(), f"a box with a strong color is drawn in gray in environment {i}.")
            shown = int(picture[colorful].mean(axis=0).argmax())
            expect(shown == channels[i], f"the color channel {channels[i]} of a box is drawn as the channel {shown}.")
        _check_storage(sim, "color", "box", np.eye(3)[channels])
        for light in ("sun", "ambient"):
            subject.expect_each(1.0, sim.parameter("light", light), 1e-12, f"light '{light}'")
            sim.write_parameter("light", light, np.full(1, 0.3), np.arange(n) == n - 1)
        dark = sim.render(None, "front", _SIZE).astype(int)
        if n > 1:
            expect_close(pictures[0], dark[0], 1, "image after the light of another environment was written")
        box = np.ptp(pictures[-1], axis=2) > 80
        ratio = dark[-1][box].mean() / pictures[-1][box].mean()
        expect(ratio < 0.8, f"with 30 % of the light, the brightness of a box is {ratio:.0%} of the one before.")


@verifies("randomize_cameras")
@after("pictures_are_true")
def cameras_move(subject: SimulatorUnderTest) -> None:
    """A camera with another position, orientation or field of view shows the image of a camera that is built so."""
    angle = 0.2  # [rad] to the left
    left = (float(np.cos(angle)), float(np.sin(angle)), 1.0)
    others: dict[str, tuple[Camera, Any]] = {
        "camera_position": (replace(_CAMERA, pos=(0.1, 0.2, 1.1), target=(1.1, 0.2, 1.1)), [0.1, 0.2, 1.1]),
        "camera_rotation": (replace(_CAMERA, target=left), [0.0, angle, 0.0]),
        "camera_fov": (replace(_CAMERA, fov_y=60.0), 60.0),
    }
    cameras = {"front": _CAMERA, **{name: camera for name, (camera, _) in others.items()}}
    with subject.build(bodies={"box": _BOX}, cameras=cameras) as (sim, _):
        n = sim.num_envs
        for name, (_, value) in others.items():
            before, nominal = sim.render(None, "front", _SIZE), sim.parameter(name, "front")
            sim.write_parameter(name, "front", np.array([value]), np.arange(n) == n - 1)
            shown, expected = sim.render(None, "front", _SIZE), sim.render(None, name, _SIZE)
            expect(n == 1 or _alike(before[0], shown[0]), f"{name} of one environment changes the image of another.")
            expect(
                _alike(expected[-1], shown[-1]),
                f"with {name} = {value}, a camera does not show the image of a camera that is built so.",
            )
            sim.write_parameter(name, "front", nominal)
        _check_storage(sim, "camera_position", "front", sim.parameter("camera_position", "front"))


@verifies("randomize_scenery")
@after("pictures_are_true")
def scenery_shows(subject: SimulatorUnderTest) -> None:
    """The numbers of a floor's pattern and of the distractors determine an image, in every environment alike."""
    with subject.build(cameras={"above": _ABOVE}) as (sim, _):
        n = sim.num_envs
        for name, target in (("texture", "floor"), ("distractors", "")):
            subject.expect_each(0.0, sim.parameter(name, target), 1e-12, name)
            ordinary = sim.render(None, "above", _SIZE)
            sim.write_parameter(name, target, np.full(n, 6.25))
            shown = sim.render(None, "above", _SIZE)
            expect(not _alike(ordinary[0], shown[0], 0.999), f"{name} = 6.25 does not change an image.")
            expect(_alike(shown[0], shown[-1]), f"{name} = 6.25 gives two environments different images.")
            sim.write_parameter(name, target, np.full(1, 3.75), np.arange(n) == n - 1)
            other = sim.render(None, "above", _SIZE)
            expect(not _alike(shown[0], other[-1], 0.999), f"{name} = 3.75 gives the image of {name} = 6.25.")
            sim.write_parameter(name, target, np.zeros(n))
            expect(_alike(ordinary[0], sim.render(None, "above", _SIZE)[0]), f"{name} = 0 does not restore the image.")
        _check_storage(sim, "texture", "floor", 1.0 + np.arange(n))


def _alike(one: Any, other: Any, share: float = _ALIKE) -> bool:
    """Return whether most pixels of two images differ by at most 8 of 255."""
    return bool((np.abs(one.astype(int) - other.astype(int)).max(axis=-1) <= 8).mean() >= share)


def _check_storage(sim: Simulation, name: str, target: str, values: Any) -> None:
    """Check that a snapshot restores a parameter, and that wrong values and targets raise an error."""
    sim.reset()
    sim.write_parameter(name, target, values)
    snapshot = sim.snapshot()
    sim.write_parameter(name, target, 0.5 * np.asarray(values))
    sim.restore(snapshot)
    expect_close(values, sim.parameter(name, target), 1e-12, f"{name} after the snapshot was restored")
    with expect_raises(ConfigurationError, f"{name} = NaN"):
        sim.write_parameter(name, target, np.full_like(values, np.nan))
    with expect_raises(UnknownNameError, f"parameter('{name}', 'no_such_target')"):
        sim.parameter(name, "no_such_target")

"""Checks of parameters that change only images."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.contracts import Simulation
from frobs_core.description import Body, Camera
from frobs_core.models import Box, Pose
from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_devkit.testing.checks import after, expect, expect_raises
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.simulator.under_test import SimulatorUnderTest, verifies

_BOX = Body(geometry=Box((0.1, 0.4, 0.4)), pose=Pose(pos=(1.5, 0.3, 1.2)), rgba=(0.5, 0.5, 0.5, 1.0), kinematic=True)
_CAMERA = Camera(pos=(0.0, 0.0, 1.0), target=(1.0, 0.0, 1.0))
_ABOVE = Camera(pos=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), fov_y=60.0)
_SIZE = (48, 64)
_ALIKE = 0.98
"""Minimum share of pixels that two equal images have in common."""


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

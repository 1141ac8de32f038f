"""Builds the scene for drawing a robot, and renders it with a simulator and a camera that shows the whole robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from frobs_core import plugins
from frobs_core.contracts import CommandMode, Simulation
from frobs_core.description import Body, Camera, Placement, Robot, Scene
from frobs_core.kernel.robot_config import find_record
from frobs_core.models import Cylinder, JointType, Pose, RobotModel, default_tcp
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import MissingDependencyError
from frobs_core.util.rotations import matrix_from_quat
from frobs_devkit.robot_sheet.poses import Shot
from frobs_devkit.simulations import simulate
from frobs_models import drawn_points

_FOV = 24.0  # [deg] small field of view, so that near and far parts appear equally large
_AZIMUTH = -55.0  # [deg] from the robot's x axis, for a view from the robot's front right
_ELEVATION = 17.0  # [deg]


@dataclass(frozen=True)
class View:
    """A camera view, and the size of its image."""

    pos: Floats  # camera position in the world frame, (3,) [m]
    axes: Floats  # right, up and back directions of the camera, as rows, (3, 3)
    size: tuple[int, int]  # height and width [pixels]
    scale: float  # approximate image scale [pixels/m]

    @property
    def camera(self) -> Camera:
        """The camera description for a scene."""
        target = self.pos - self.axes[2]
        x, y, z = self.pos.tolist()
        tx, ty, tz = target.tolist()
        return Camera(pos=(x, y, z), target=(tx, ty, tz), fov_y=_FOV)

    def project(self, points: Floats) -> Floats:
        """Return the image positions (n, 2) [pixels] of points (n, 3) [m], relative to the top left corner."""
        right, up, back = ((points - self.pos) @ self.axes.T).T
        height, width = self.size
        focal = 0.5 * height / math.tan(math.radians(_FOV) / 2.0)
        return np.stack([width / 2.0 - focal * right / back, height / 2.0 + focal * up / back], axis=1)


def frame(points: Floats, size: tuple[int, int], fill: tuple[float, float]) -> View:
    """Return the closest view that shows all points (n, 3) [m] in the world frame.

    The image has a size (height, width) [pixels], and the points may ``fill`` these fractions of its height and width.
    """
    azimuth, elevation = math.radians(_AZIMUTH), math.radians(_ELEVATION)
    back = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])
    x, y, z = (points @ axes.T).T
    slope = math.tan(math.radians(_FOV) / 2.0)
    # A point is left of the right edge if x − cx ≤ k·(cz − z), right of the left edge if cx − x ≤ k·(cz − z), …
    place, distances = [], []
    for along, k in ((x, slope * size[1] / size[0] * fill[1]), (y, slope * fill[0])):
        one, other = (along + k * z).max(), (-along + k * z).max()
        place.append((one - other) / 2.0)
        distances.append((one + other) / (2.0 * k))
    least = z.max() + 0.05  # keeps the camera in front of all points, even if the points coincide
    distance = max(*distances, least)
    scale = size[0] / (2.0 * slope * (distance - float(z.mean())))
    return View(np.array([*place, distance]) @ axes, axes, size, scale)


_FINER = 2  # supersampling factor
_NEAR = 0.02  # [m] if the root is closer to the floor than this, the robot needs no pedestal
_AXIS = 0.1  # length of the tool frame's axes, relative to the robot's size
_STONE = (0.42, 0.44, 0.48, 1.0)


@dataclass(frozen=True)
class Tile:
    """A rendered image."""

    shot: Shot  # shot that the image shows
    picture: np.ndarray[Any, Any]  # (h, w, 3) uint8
    joints: Floats  # positions of the actuated joints in the image, (dof, 2) [pixels]
    tool: Floats  # origin and axis ends of the tool frame, (4, 2) [pixels]


class Stage:
    """A scene with a robot that stands on a pedestal, or on its own feet or wheels, for all shots to render.

    The default simulator is the first that can render.
    """

    def __init__(self, robot: Robot, model: RobotModel, shots: Sequence[Shot], simulator: str | None) -> None:
        self.model = model
        self.tcp = robot.tcp or default_tcp(model)
        self._robot = replace(robot, base="fixed", sensors={})
        self._record = _choose(simulator)
        points = drawn_points(model, np.array([shot.joint_positions for shot in shots]))
        clouds = np.concatenate(list(points.values()), axis=1)  # (shots, n, 3)
        self.size = float(np.linalg.norm(clouds[0].max(axis=0) - clouds[0].min(axis=0))) or 1.0
        bottoms = clouds[..., 2].min(axis=1)
        foot = np.concatenate([points[name][0] for name in _foot(model)])
        self._pedestal: Body | None = None
        heights = -bottoms
        if model.joint_names and robot.base == "fixed" and foot[:, 2].min() < bottoms[0] + _NEAR:
            heights = np.full(len(shots), max(0.0, -bottoms.min()))
            self._pedestal = _pedestal(foot, heights[0] + foot[:, 2].min())
        self._ground = _ground(float(np.abs(clouds[..., :2]).max()))
        self._heights = {id(shot): float(height) for shot, height in zip(shots, heights, strict=True)}
        self._clouds = {
            id(shot): np.concatenate([cloud, self._tool(shot)]) + np.array([0.0, 0.0, self._heights[id(shot)]])
            for shot, cloud in zip(shots, clouds, strict=True)
        }

    def view(self, shots: Sequence[Shot], size: tuple[int, int], fill: tuple[float, float]) -> View:
        """Return a view that shows all given shots. The other arguments are those of :func:`frame`."""
        return frame(np.concatenate([self._clouds[id(shot)] for shot in shots]), size, fill)

    def draw(self, groups: Sequence[tuple[Sequence[Shot], View]]) -> list[list[Tile]]:
        """Render groups of shots, each group with its own view."""
        placement = Placement(robot=self._robot, model=self.model, command_mode=CommandMode.POSITION)
        bodies = {"ground": self._ground, **({} if self._pedestal is None else {"pedestal": self._pedestal})}
        cameras = {f"view_{i}": view.camera for i, (_, view) in enumerate(groups)}
        scene = Scene(bodies=bodies, cameras=cameras, gravity=(0.0, 0.0, 0.0))
        with simulate(self._record, placement, scene) as (simulation, _):
            return [
                [self._draw(simulation, shot, view, f"view_{i}") for shot in shots]
                for i, (shots, view) in enumerate(groups)
            ]

    def _draw(self, simulation: Simulation, shot: Shot, view: View, camera: str) -> Tile:
        handle, (height, width) = simulation.robots["robot"], view.size
        rise = np.array([[0.0, 0.0, self._heights[id(shot)]]])
        handle.write_base_pose(rise, np.array([[1.0, 0.0, 0.0, 0.0]]))
        if handle.dof:
            handle.write_joint_state(shot.joint_positions[None])
        fine = simulation.render(camera=camera, size=(_FINER * height, _FINER * width))[0]
        picture = fine.reshape(height, _FINER, width, _FINER, 3).mean(axis=(1, 3)).round().astype(np.uint8)
        positions = shot.joint_positions[None]
        places = [self.model.frame_pose(joint.child, positions)[0][0] for joint in self.model.actuated_joints]
        joints = view.project(np.array(places).reshape(-1, 3) + rise)
        return Tile(shot, picture, joints, view.project(self._tool(shot) + rise))

    def _tool(self, shot: Shot) -> Floats:
        """Return the origin and the axis ends of the tool frame, (4, 3) [m], relative to the root link."""
        pos, quat = (array[0] for array in self.model.frame_pose(self.tcp, shot.joint_positions[None]))
        ends = pos + _AXIS * self.size * matrix_from_quat(quat).T  # rows: the ends of the x, y and z axes
        return np.concatenate([pos[None], ends])


def _choose(name: str | None) -> SimulatorRecord:
    if name is not None:
        return find_record(SimulatorRecord, name)
    for record in plugins.records("simulator").values():
        assert isinstance(record, SimulatorRecord)
        if not record.is_paced and record.capabilities.get("cameras", Level.UNSUPPORTED) > Level.UNSUPPORTED:
            return record
    raise MissingDependencyError("a picture", ["a simulator"], "pip install frobs-sim-mujoco")


def _foot(model: RobotModel) -> list[str]:
    fixed = [model.root]
    for joint in model.joints:  # a single pass, which misses joints that are listed before their parent joints
        if joint.type is JointType.FIXED and joint.parent in fixed and joint.child not in fixed:
            fixed.append(joint.child)
    return fixed


def _ground(reach: float) -> Body:
    """Return an invisible plate under the floor. Its size determines the area in which the engine draws shadows."""
    plate = Cylinder(radius=2.5 * reach + 0.1, length=0.01)
    return Body(geometry=plate, pose=Pose(pos=(0.0, 0.0, -0.05)), collides=False)


def _pedestal(foot: Floats, height: float) -> Body | None:
    """Return a column under the robot's root, or None if the root is already on the floor."""
    if height < _NEAR:
        return None
    low, high = foot[:, :2].min(axis=0), foot[:, :2].max(axis=0)
    x, y = ((low + high) / 2.0).tolist()
    radius = max(0.03, 0.6 * float((high - low).max()))
    column = Cylinder(radius=radius, length=height)
    return Body(geometry=column, pose=Pose(pos=(x, y, height / 2.0)), collides=False, rgba=_STONE)

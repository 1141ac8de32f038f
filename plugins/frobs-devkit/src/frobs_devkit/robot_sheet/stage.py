"""The scene in which a robot is drawn, and the simulator that draws it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from frobs_core import plugins
from frobs_core.arrays import Floats
from frobs_core.capabilities import Level
from frobs_core.errors import MissingDependencyError
from frobs_core.interfaces import Body, CommandMode, Placement, Robot, Scene, Simulation
from frobs_core.models import Cylinder, JointType, Pose, RobotModel, default_tcp, drawn_points
from frobs_core.rotations import matrix_from_quat
from frobs_core.specs import SimulatorRecord
from frobs_devkit.robot_sheet.framing import View, frame
from frobs_devkit.robot_sheet.poses import Shot

_FINER = 2  # pictures are drawn this much finer, and then averaged
_TIMESTEP = 0.002  # [s]; nothing is stepped
_NEAR = 0.02  # [m]: a robot whose root is so near to its lowest point stands on it
_AXIS = 0.1  # length of the tool frame's axes, of the robot's size
_STONE = (0.42, 0.44, 0.48, 1.0)


@dataclass(frozen=True)
class Tile:
    """A picture that was drawn.

    Attributes:
        shot: What it shows.
        picture: (h, w, 3) uint8
        joints: (dof, 2) [pixels] where the actuated joints are.
        tool: (4, 2) [pixels] the tool frame's origin and the ends of its axes.
    """

    shot: Shot
    picture: np.ndarray[Any, Any]
    joints: Floats
    tool: Floats


class Stage:
    """A robot on its pedestal, or on its own feet and wheels.

    Args:
        robot: Its description.
        model: Its model file, read.
        shots: Everything that will be drawn.
        simulator: Name of the simulator; None: the first that draws.

    Raises:
        ConfigurationError: No simulator that draws is installed.
        ModelFileError: The simulator cannot build the robot.
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
        """Return the view in which all of some shots are seen; the arguments are those of :func:`frame`."""
        return frame(np.concatenate([self._clouds[id(shot)] for shot in shots]), size, fill)

    def draw(self, groups: Sequence[tuple[Sequence[Shot], View]]) -> list[list[Tile]]:
        """Draw groups of shots, each through a view of its own.

        Raises:
            RenderingUnavailableError: Nothing can be drawn on this machine.
        """
        placement = Placement(robot=self._robot, model=self.model, command_mode=CommandMode.POSITION)
        bodies = {"ground": self._ground, **({} if self._pedestal is None else {"pedestal": self._pedestal})}
        cameras = {f"view_{i}": view.camera for i, (_, view) in enumerate(groups)}
        scene = Scene(bodies=bodies, cameras=cameras, gravity=(0.0, 0.0, 0.0))
        cls: type[Simulation] = self._record.load()
        with closing(cls({"robot": placement}, scene, num_envs=1, physics_timestep=_TIMESTEP)) as simulation:
            simulation.reset()
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
        """Return the tool frame's origin and the ends of its axes, (4, 3) [m] relative to the root link."""
        pos, quat = (array[0] for array in self.model.frame_pose(self.tcp, shot.joint_positions[None]))
        ends = pos + _AXIS * self.size * matrix_from_quat(quat).T  # rows: the ends of x, y, z
        return np.concatenate([pos[None], ends])


def _choose(name: str | None) -> SimulatorRecord:
    if name is not None:
        record = plugins.get_record("simulator", name)
        assert isinstance(record, SimulatorRecord)
        return record
    for record in plugins.records("simulator").values():
        assert isinstance(record, SimulatorRecord)
        if record.capabilities.get("cameras", Level.UNSUPPORTED) > Level.UNSUPPORTED:
            return record
    raise MissingDependencyError("a picture", ["a simulator"], "pip install frobs-sim-mujoco")


def _foot(model: RobotModel) -> list[str]:
    """Return the root link and what is fixed to it."""
    found = [model.root]
    for joint in model.joints:  # parents come before children only by habit, so this goes on until nothing is new
        if joint.type is JointType.FIXED and joint.parent in found and joint.child not in found:
            found.append(joint.child)
    return found


def _ground(reach: float) -> Body:
    """Return a plate under the floor that nobody sees: by its size engines choose how far shadows are computed."""
    return Body(
        geometry=Cylinder(radius=2.5 * reach + 0.1, length=0.01), pose=Pose(pos=(0.0, 0.0, -0.05)), collides=False
    )


def _pedestal(foot: Floats, height: float) -> Body | None:
    """Return a column under a robot's foot; None where it stands on the floor already."""
    if height < _NEAR:
        return None
    low, high = foot[:, :2].min(axis=0), foot[:, :2].max(axis=0)
    x, y = ((low + high) / 2.0).tolist()
    radius = max(0.03, 0.6 * float((high - low).max()))
    return Body(
        geometry=Cylinder(radius=radius, length=height),
        pose=Pose(pos=(x, y, height / 2.0)),
        collides=False,
        rgba=_STONE,
    )

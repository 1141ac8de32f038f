"""Reads the poses, twists and Jacobians of one robot's links in one environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from frobs_sim_pybullet.articulation import Articulation
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.drive import Drive
from frobs_sim_pybullet.transforms import IDENTITY, Quat, Vector, compose, cross, rotate

_UNTURNED = IDENTITY[1]


class Frames:
    """Reads poses, twists and Jacobians of a robot's links into one environment's row of the shared arrays."""

    def __init__(self, articulation: Articulation, drive: Drive, row: Mapping[str, np.ndarray[Any, Any]]) -> None:
        self._robot, self._drive, self._row = articulation, drive, row

    def reader(self, kind: str, link: str) -> Callable[[], None]:
        """Return a function that reads a link's pose, twist or Jacobian into the shared arrays."""
        body, offset = self._robot.bones.frames[link]
        index = self._robot.links[body]
        row = self._row[f"robots/{self._robot.name}/{kind}/{link}"]
        on_com = compose(self._robot.com_backs[index], offset)
        match kind:
            case "pose":
                return lambda: self._read_pose(index, on_com, row)
            case "twist":
                return lambda: self._read_twist(index, on_com, row)
        point = self._robot.on_twin(index, offset[0])
        twin = self._robot.twin_links[body]
        return lambda: self._read_jacobian(twin, point, row)

    def _read_pose(self, index: int, offset: tuple[Vector, Quat], row: np.ndarray[Any, Any]) -> None:
        pos, (x, y, z, w) = compose(self._robot.com(index), offset)
        row[:] = (*pos, w, x, y, z)

    def _read_twist(self, index: int, offset: tuple[Vector, Quat], row: np.ndarray[Any, Any]) -> None:
        robot = self._robot
        if index < 0:
            lin, ang = p.getBaseVelocity(robot.body, robot.client)
        else:
            lin, ang = p.getLinkState(robot.body, index, 1, 1, robot.client)[6:8]
        x, y, z = cross(ang, rotate(robot.com(index)[1], offset[0]))
        row[:] = (lin[0] + x, lin[1] + y, lin[2] + z, *ang)

    def _read_jacobian(self, twin: int, point: Vector, row: np.ndarray[Any, Any]) -> None:
        robot = self._robot
        row[:] = 0.0
        if twin < 0 or not robot.joints:
            return
        robot.refresh()
        q = self._drive.positions()
        zeros = [0.0] * len(q)
        linear, angular = p.calculateJacobian(robot.twin, twin, point, q, zeros, zeros, robot.dynamics.client)
        both = np.array([linear, angular])[:, :, robot.offset :]  # (2, 3, moving), in the base's axes
        turn = robot.base()[1]
        if turn != _UNTURNED:
            matrix = np.array([rotate(turn, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T
            both = matrix @ both
        for follower, leader, mimic in robot.mimics:
            both[:, :, leader] += mimic.multiplier * both[:, :, follower]
        row[:] = both.reshape(6, -1)[:, robot.slots]

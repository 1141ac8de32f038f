"""Instruments of the built-in sensor types."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_core.contracts import RobotHandle, Simulation, Snapshot
from frobs_core.description import Contact, Scene, Sensor
from frobs_core.sensing.sensors.instrument import Instrument
from frobs_core.util.arrays import Floats, Mask, rows_of
from frobs_core.util.rotations import quat_conjugate, quat_rotate


class LidarInstrument(Instrument):
    """Instrument that measures the distance along each ray [m]."""

    def measure(self) -> Floats:
        return self.robot.lidar(self.name)


class ForceTorqueInstrument(Instrument):
    """Instrument that measures the force and torque that a joint transmits, in the sensor's frame."""

    def measure(self) -> Floats:
        """Return force [N] and torque [N·m], (num_envs, 6)."""
        return self.simulation.sensor_wrench(self.robot.name, self.name)


class BumperInstrument(Instrument):
    """Instrument that reads 1.0 if any of a bumper's links touched something, and 0.0 otherwise."""

    @classmethod
    def contacts(cls, name: str, sensor: Any, robot: str, scene: Scene) -> Mapping[str, Contact]:
        """Return one contact for each link. If there is no floor, ``"floor"`` is removed from the ignored objects."""
        there = tuple(side for side in sensor.ignore if side != "floor" or scene.floor)
        return {_contact(name, link, robot): Contact(first=f"{robot}/{link}", ignore=there) for link in sensor.frames}

    def measure(self) -> Floats:
        contacts = [_contact(self.name, link, self.robot.name) for link in self.sensor.frames]
        touched: Mask = np.any([self.simulation.contact(contact) for contact in contacts], axis=0)
        return touched[:, None].astype(np.float64)


def _contact(name: str, link: str, robot: str) -> str:
    return f"{robot}/{name}/{link}"


class ImuInstrument(Instrument):
    """Instrument that measures angular velocity [rad/s] and specific force [m/s²] in the link's frame."""

    def __init__(
        self, name: str, sensor: Sensor, simulation: Simulation, robot: RobotHandle, control_timestep: float
    ) -> None:
        super().__init__(name, sensor, simulation, robot, control_timestep)
        imu: Any = sensor
        self._frame: str = imu.frame
        self._offset: Floats = np.tile(np.asarray(imu.offset, np.float64), (robot.num_envs, 1))  # (num_envs, 3)
        self._moved = bool(self._offset.any())
        self._velocity: Floats = np.zeros((robot.num_envs, 3))  # [m/s] linear velocity of the sensor in the world frame
        self._acceleration: Floats = np.zeros((robot.num_envs, 3))  # [m/s²] acceleration in the world frame

    def reset(self, mask: Mask | None) -> None:
        """Discard the previous velocity, so that the acceleration is 0 after a reset."""
        rows = rows_of(mask)
        self._velocity[rows] = self._measure_velocity()[rows]
        self._acceleration[rows] = 0.0

    def advance(self) -> None:
        """Compute the acceleration from the change in velocity over the control step."""
        velocity = self._measure_velocity()
        self._acceleration = (velocity - self._velocity) / self.control_timestep
        self._velocity = velocity

    def measure(self) -> Floats:
        _, quat = self.robot.frame_pose(self._frame)
        _, ang_vel_world = self.robot.frame_velocity(self._frame)
        into = quat_conjugate(quat)
        force = self._acceleration - self.simulation.parameter("gravity")
        return np.concatenate([quat_rotate(into, ang_vel_world), quat_rotate(into, force)], axis=1)

    def _measure_velocity(self) -> Floats:
        """Return the sensor's linear velocity in the world frame, (num_envs, 3) [m/s], as a new array."""
        lin_vel_world, ang_vel_world = self.robot.frame_velocity(self._frame)
        if not self._moved:
            return lin_vel_world.copy()
        arm = quat_rotate(self.robot.frame_pose(self._frame)[1], self._offset)
        return lin_vel_world + np.cross(ang_vel_world, arm)

    def stored_arrays(self) -> Snapshot:
        return {"velocity": self._velocity, "acceleration": self._acceleration}

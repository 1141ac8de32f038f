"""Reads the force-torque sensors of robots and averages their readings over each control step."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from frobs_core.description import Placement
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError

_HIDDEN = int(mujoco.mjNGROUP) - 1  # site group that is not rendered
_TYPES = mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE


def add_force_torque_sensors(spec: mujoco.MjSpec, robot: str, placement: Placement) -> None:
    """Add a force sensor, a torque sensor and a site for each of a robot's force-torque sensors.

    The site is attached to the child body of the measured joint and defines the sensor's frame. MuJoCo's force sensor
    reports the force that the parent body exerts on the child body.

    Raises:
        UnsuitableRobotError: A sensor lies between two joints of the same MJCF body.
    """
    for sensor, (link, pose) in placement.force_torque_sensors.items():
        name, body = f"{robot}/{sensor}", spec.body(f"{robot}/{link}")
        if body is None:
            raise UnsuitableRobotError(
                robot, f"has no MJCF body '{link}', which the force-torque sensor '{sensor}' requires."
            )
        body.add_site(name=name, pos=pose.pos, quat=pose.quat_wxyz, group=_HIDDEN)
        for number, kind in enumerate(_TYPES):
            spec.add_sensor(name=f"{name} {number}", type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name)


class WrenchReader:
    """Reads the force-torque sensors of a model.

    MuJoCo's sensors use the accelerations before integration. The integrator treats the drives' damping implicitly and
    therefore applies other accelerations. This class adds the resulting difference in force: the inertia beyond the
    sensor times the difference between the accelerations.

    Args:
        model: Compiled model that contains the sensors.
        robots: Robots, by name.

    Attributes:
        fields: MjData fields that must be recorded after each physics step, in addition to ``sensordata``.
    """

    def __init__(self, model: mujoco.MjModel, robots: Mapping[str, Placement]) -> None:
        self._timestep = model.opt.timestep
        self._sensors = {
            f"{robot}/{sensor}": _Sensor(model, f"{robot}/{sensor}")
            for robot, placement in robots.items()
            for sensor in placement.force_torque_sensors
        }
        self.names = tuple(self._sensors)
        self.fields = ("qvel", "qacc", "crb", "cdof", "subtree_com", "site_xpos", "site_xmat")

    def read(self, recorded: Mapping[str, Floats], qvel: Floats) -> dict[str, Floats]:
        """Return each sensor's mean reading over a control step, (num_envs, 6) [N, N·m], by ``robot/sensor``.

        Args:
            recorded: ``sensordata`` and :attr:`fields` after each physics step, (num_envs, decimation, …) each.
            qvel: Velocities before the first physics step, (num_envs, nv).
        """
        velocities = np.concatenate([qvel[:, None], recorded["qvel"]], axis=1)
        difference = np.diff(velocities, axis=1) / self._timestep - recorded["qacc"]  # (num_envs, decimation, nv)
        return {name: sensor.read(recorded, difference).mean(axis=1) for name, sensor in self._sensors.items()}


class _Sensor:
    """One force-torque sensor, named ``robot/sensor``, of a compiled model."""

    def __init__(self, model: mujoco.MjModel, name: str) -> None:
        starts = [int(model.sensor(f"{name} {number}").adr[0]) for number in range(len(_TYPES))]
        self._columns = [start + axis for start in starts for axis in range(3)]
        self._site = model.site(name).id
        link = int(model.site_bodyid[self._site])
        self._tree = int(model.body_rootid[link])
        # Maps each degree of freedom to the root of the subtree that it moves beyond the sensor: the sensor's link, or
        # the joint's own body if the joint is beyond the sensor.
        moved = {dof: link for dof in range(model.nv) if _hangs_from(model, link, int(model.dof_bodyid[dof]))}
        beyond = {dof: int(body) for dof, body in enumerate(model.dof_bodyid) if _hangs_from(model, int(body), link)}
        self._moved = beyond | moved

    def read(self, recorded: Mapping[str, Floats], difference: Floats) -> Floats:
        """Return the sensor's reading after each physics step, (num_envs, decimation, 6)."""
        dofs, bodies = list(self._moved), list(self._moved.values())
        motion = recorded["cdof"][:, :, dofs] * difference[:, :, dofs, None]  # (num_envs, decimation, dofs, 6)
        inertia = recorded["crb"][:, :, bodies]  # relative to the tree's center of mass, like ``cdof``
        spin, acceleration, moment = motion[..., :3], motion[..., 3:], inertia[..., 6:9]
        xx, yy, zz, xy, xz, yz = np.moveaxis(inertia[..., :6], -1, 0)
        tensor = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1).reshape(*xx.shape, 3, 3)
        force = (inertia[..., 9:] * acceleration + np.cross(spin, moment)).sum(axis=2)
        torque = ((tensor * spin[..., None, :]).sum(axis=-1) + np.cross(moment, acceleration)).sum(axis=2)
        torque += np.cross(recorded["subtree_com"][:, :, self._tree] - recorded["site_xpos"][:, :, self._site], force)
        turn = recorded["site_xmat"][:, :, self._site].reshape(*force.shape, 3)
        added = [(part[..., None] * turn).sum(axis=-2) for part in (force, torque)]  # in the sensor's frame
        wrench: Floats = recorded["sensordata"][..., self._columns] + np.concatenate(added, axis=-1)
        return wrench


def _hangs_from(model: mujoco.MjModel, body: int, ancestor: int) -> bool:
    """Return whether a body is ``ancestor`` itself or one of its descendants."""
    while body > ancestor:  # parents have smaller indices
        body = int(model.body_parentid[body])
    return body == ancestor

"""The compensation of gravity takes the weight of each link to act at the link's frame, not at its center of mass."""

from __future__ import annotations

import numpy as np

from frobs_controllers.tcp_impedance import TcpImpedance
from frobs_core.models import joint_path


class Faulty(TcpImpedance):
    def bind(self, joints, control_timestep, decimation):
        super().bind(joints, control_timestep, decimation)
        self._sound, self._dynamics = self._dynamics, self._mass_and_weight
        self._weights = [
            (link.name, link.inertial.mass, np.array(link.inertial.origin.pos))
            for link in joints.model.links
            if link.inertial is not None and joint_path(joints.model, link.name)
        ]

    def _mass_and_weight(self, gravity):
        return self._sound(gravity)[0], self._gravity_efforts()

    def _gravity_efforts(self):
        joints = self._joints
        efforts = np.zeros((joints.num_envs, joints.dof))
        for link, mass, _ in self._weights:
            lift = np.broadcast_to(-mass * self._gravity, (joints.num_envs, 3))
            efforts += (joints.frame_jacobian(link)[:, :3] * lift[:, :, None]).sum(axis=1)
        return efforts

"""The gravity compensation places each link's center of mass as if the link's axes were those of the world."""

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
        for link, mass, center in self._weights:
            jacobian = joints.frame_jacobian(link)
            arm = np.broadcast_to(center, (joints.num_envs, 3))
            lift = np.broadcast_to(-mass * self._gravity, arm.shape)
            wrench = np.concatenate([lift, np.cross(arm, lift)], axis=1)
            efforts += (jacobian * wrench[:, :, None]).sum(axis=1)
        return efforts

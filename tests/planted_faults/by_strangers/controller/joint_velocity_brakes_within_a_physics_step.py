"""A joint is slowed down near a limit so that it stays within it for one physics step, although the command is held for a whole control step."""

from __future__ import annotations

from frobs_controllers.joint_velocity import JointVelocity


class Faulty(JointVelocity):
    def bind(self, joints, control_timestep, decimation):
        super().bind(joints, control_timestep, decimation)
        physics_timestep = control_timestep / decimation
        self._rate[:] = 1.0 / physics_timestep

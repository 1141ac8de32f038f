"""A force-torque sensor reads what the child exerts on the parent: every sign is the other one."""

from __future__ import annotations

from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras"
APPROXIMATE = ""


class Faulty(MujocoSimulation):
    def step(self, decimation):
        super().step(decimation)
        for wrench in self.sensor_wrenches.values():
            wrench *= -1.0

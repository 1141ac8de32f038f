"""The joint efforts that are read are those that the drives asked for, before the effort limit cuts them."""

from __future__ import annotations

import numpy as np

from templates import my_simulator

EXACT = "determinism snapshot teleport pause batched"
APPROXIMATE = "drive"


class _Robot(my_simulator.JointRobot):
    def _drive(self, target, seconds, weight):
        asked = self._factor * target - self._active_stiffness * self._q - self._active_damping * self._v
        super()._drive(target, seconds, weight)
        self._efforts[:] = asked


class Faulty(my_simulator.MySimulator):
    def __init__(self, robots, scene, *, num_envs, physics_timestep, num_threads=0):
        super().__init__(robots, scene, num_envs=num_envs, physics_timestep=physics_timestep)
        self.robots = self._robots = {
            name: _Robot(name, placement, num_envs, np.array(scene.gravity)) for name, placement in robots.items()
        }
        for name, robot in self._robots.items():
            self._state |= {f"robots/{name}/{key}": array for key, array in robot.arrays.items()}

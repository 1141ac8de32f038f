"""After a step with a command for each physics step, the first of them is held, not the last."""

from __future__ import annotations

import numpy as np

from templates import my_simulator

EXACT = "determinism snapshot teleport pause batched"
APPROXIMATE = "drive"


class _Robot(my_simulator.JointRobot):
    def command(self, values):
        super().command(values)
        if values.ndim == 3:
            self._command[:] = values[:, 0]


class Faulty(my_simulator.MySimulator):
    def __init__(self, robots, scene, *, num_envs, physics_timestep, num_threads=0):
        super().__init__(robots, scene, num_envs=num_envs, physics_timestep=physics_timestep)
        self.robots = self._robots = {
            name: _Robot(name, placement, num_envs, np.array(scene.gravity)) for name, placement in robots.items()
        }
        for name, robot in self._robots.items():
            self._state |= {f"robots/{name}/{key}": array for key, array in robot.arrays.items()}

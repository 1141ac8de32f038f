"""A body's pose that is written for some environments goes to the first ones, not to those of the mask."""

from __future__ import annotations

import numpy as np

from templates import my_simulator

EXACT = "determinism snapshot teleport pause batched"
APPROXIMATE = "drive"


class _Body(my_simulator.FreeBody):
    def write_pose(self, pos, quat_wxyz=None, mask=None):
        first = None if mask is None else np.arange(len(mask)) < mask.sum()
        super().write_pose(pos, quat_wxyz, first)


class Faulty(my_simulator.MySimulator):
    def __init__(self, robots, scene, *, num_envs, physics_timestep, num_threads=0):
        super().__init__(robots, scene, num_envs=num_envs, physics_timestep=physics_timestep)
        self.bodies = self._bodies = {
            name: _Body(name, num_envs, body.pose, body.is_free, body.kinematic or body.is_free, body.twist)
            for name, body in scene.bodies.items()
        }
        for name, body in self._bodies.items():
            self._state |= {f"bodies/{name}/{key}": array for key, array in body.arrays.items()}

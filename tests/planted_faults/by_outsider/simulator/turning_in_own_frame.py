"""The angular velocity of a body is read in its own frame, as the engine keeps it, not in the world."""

from __future__ import annotations

from frobs_core.util.rotations import quat_conjugate, quat_rotate
from templates import my_simulator

EXACT = "determinism snapshot teleport pause batched"
APPROXIMATE = "drive"


class _Body(my_simulator.FreeBody):
    @property
    def twist(self):
        linear, angular = super().twist
        return linear, quat_rotate(quat_conjugate(self.quat), angular)


class Faulty(my_simulator.MySimulator):
    def __init__(self, robots, scene, *, num_envs, physics_timestep, num_threads=0):
        super().__init__(robots, scene, num_envs=num_envs, physics_timestep=physics_timestep)
        self.bodies = self._bodies = {
            name: _Body(name, num_envs, body.pose, body.is_free, body.kinematic or body.is_free, body.twist)
            for name, body in scene.bodies.items()
        }
        for name, body in self._bodies.items():
            self._state |= {f"bodies/{name}/{key}": array for key, array in body.arrays.items()}

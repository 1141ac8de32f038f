"""Reads and writes physical parameters that differ between environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from frobs_core.models import inertia_matrix
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.rotations import matrix_from_quat
from frobs_models import WrittenParameters
from frobs_sim_gazebo import protocol
from frobs_sim_gazebo.protocol import Op

if TYPE_CHECKING:
    from frobs_sim_gazebo.fleet import Message
    from frobs_sim_gazebo.simulation import GazeboSimulation


class GazeboParameters(WrittenParameters):
    """The parameters of a Gazebo simulation."""

    def __init__(self, simulation: GazeboSimulation) -> None:
        super().__init__(simulation.placements, simulation.scene, simulation.robots, simulation.num_envs)
        self._simulation = simulation

    def collides(self, target: str) -> bool:
        """Return whether the target has a collision shape in Gazebo."""
        return bool(self._simulation.layout.shapes[target])

    def write(self, name: str, target: str, values: Floats, mask: Mask | None) -> None:
        super().write(name, target, values, mask)
        if name == "joint_damping":
            self._simulation.stale_gains[self._simulation.envs(mask)] = True

    def apply(self, name: str, target: str, mask: Mask | None) -> None:
        """Queue messages that set a parameter before the next step, on the servers selected by ``mask``."""
        for env in self._simulation.envs(mask):
            for op, body in self._messages(env, name, target):
                self._simulation.later(env, op, body)

    def messages(self, env: int) -> list[Message]:
        """Return the messages that set all written parameters on a new server."""
        return [message for key in self.written for message in self._messages(env, *key)]

    def _messages(self, env: int, name: str, target: str) -> list[Message]:
        simulation = self._simulation
        value = self.written[name, target][env]
        if name == "gravity":
            return [(Op.GRAVITY, protocol.numbers(value))]
        if name == "friction":
            return [(Op.FRICTION, protocol.indices(simulation.layout.shapes[target]) + protocol.numbers(value))]
        number, _ = centre(simulation, target)
        if number is None:
            return []  # the mass of a fixed body has no effect
        if target in simulation.scene.bodies:
            inertial = simulation.scene.bodies[target].inertial
            assert inertial is not None
            weight, inertia = float(value), inertia_matrix(inertial) * (float(value) / inertial.mass)
        else:
            robot = target.partition("/")[0]
            changed = {
                key.partition("/")[2]: float(values[env])
                for (kind, key), values in self.written.items()
                if kind == "mass" and key.partition("/")[0] == robot and key not in simulation.scene.bodies
            }
            masses = simulation.layout.skeletons[robot].masses(changed)[
                number - simulation.layout.bodies["robot", robot].start
            ]
            weight, inertia = masses.mass, masses.inertia
        upper = inertia[np.triu_indices(3)]  # ixx, ixy, ixz, iyy, iyz, izz
        return [(Op.MASS, protocol.count(number) + protocol.numbers([weight, *upper]))]


def centre(simulation: GazeboSimulation, target: str) -> tuple[int | None, Floats]:
    """Return the moving body that includes the target (a scene body or link), and the target's center of mass.

    Returns:
        The index of the moving body, or None if the moving body is fixed, and the target's center of mass relative to
        the moving body's center of mass, in the moving body's axes, (3,) [m].
    """
    layout = simulation.layout
    if target in simulation.scene.bodies:
        span = layout.bodies.get(("body", target))
        return (None if span is None else span.start), np.zeros(3)
    robot, _, name = target.partition("/")
    placement = simulation.placements[robot]
    body, offset = layout.skeletons[robot].frames[name]
    number = layout.bodies["robot", robot].start + body
    link = next(link for link in placement.model.links if link.name == name)
    own = np.zeros(3) if link.inertial is None else np.array(link.inertial.origin.pos)
    point = offset[:3] + (matrix_from_quat(offset[3:]) * own).sum(-1) - layout.coms[number]
    return (None if body == 0 and placement.robot.base == "fixed" else number), point

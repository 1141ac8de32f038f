"""PyBullet without FRobs, for benchmarks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frobs_core.contracts import Snapshot
from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.block import Block
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.law import law

if TYPE_CHECKING:
    from frobs_sim_pybullet.simulation import PybulletSimulation


class BarePybullet:
    """Minimal PyBullet loop for benchmarks, which applies joint commands and the drive law to one arm.

    Args:
        simulation: A simulation for which :meth:`knows` returns True.
    """

    @staticmethod
    def knows(simulation: PybulletSimulation) -> bool:
        """Return whether the only robot of a simulation has a fixed base, no mimic joints and no joint friction."""
        placements = list(simulation.placements.values())
        joints = [joint for placement in placements for joint in placement.model.joints]
        plain = not any(joint.mimic or joint.friction for joint in joints)
        return len(placements) == 1 and placements[0].robot.base == "fixed" and plain

    def __init__(self, simulation: PybulletSimulation) -> None:
        placements, name = dict(simulation.placements), next(iter(simulation.placements))
        arrays = {key: value[:1].copy() for key, value in simulation.arrays.items()}
        self._block = Block(placements, simulation.scene, simulation.engine, arrays, [0])
        self._world = self._block.worlds[0]
        self._robot = self._world.robots[name]
        self._count = simulation.num_envs
        self._h = simulation.physics_timestep
        self._limits = [float(limit) for limit in simulation.robots[name].effort_limit[0]]
        self._name = name
        self._robot.dynamics.set_gravity(simulation.scene.gravity)

    def load(self, snapshot: Snapshot) -> None:
        """Load the first environment's state and controls from a snapshot."""
        gains = snapshot[f"robots/{self._name}/gains"][0].tolist()
        self._controls = [snapshot[f"robots/{self._name}/command"][0].tolist(), *gains]
        self._world.load(snapshot["bullet"][0], int(snapshot["bullet_bytes"][0]), 0, False)

    def step(self, decimation: int) -> None:
        """Execute ``decimation`` physics steps for each environment, all in the first environment's world."""
        robot, h = self._robot, self._h
        body, joints, client = robot.body, robot.joints, robot.client
        twin, dynamics, zeros = robot.twin, robot.dynamics.client, [0.0] * len(robot.joints)
        command, stiffness, dampings, passive = self._controls
        rest = [h * d for d in passive], [h * k for k in dampings]
        constants = list(zip(stiffness, dampings, self._limits, passive, *rest, strict=True))
        for _ in range(decimation * self._count):
            states = p.getJointStates(body, joints, client)
            q, v = [state[0] for state in states], [state[1] for state in states]
            mass = p.calculateMassMatrix(twin, q, 0, dynamics)
            bias = p.calculateInverseDynamics(twin, q, v, zeros, 0, dynamics)
            forces, _ = law(q, v, command, constants, mass, bias)
            p.setJointMotorControlArray(body, joints, p.TORQUE_CONTROL, forces=forces, physicsClientId=client)
            p.stepSimulation(client)

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> None:
        """Cast the rays of all environments in sequence, in the first environment's world."""
        for start, direction in zip(origins, directions, strict=True):
            ends = start + max_range * direction
            p.rayTestBatch(start.tolist(), ends.tolist(), numThreads=1, physicsClientId=self._robot.client)

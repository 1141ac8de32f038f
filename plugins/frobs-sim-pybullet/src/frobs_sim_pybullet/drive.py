"""The drives of one robot in one environment, at the physics rate."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_sim_pybullet.articulation import FASTEST, Articulation
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.friction import Friction
from frobs_sim_pybullet.law import solver
from frobs_sim_pybullet.transforms import Quat, Vector, compose, conjugate, cross, invert, rotate


class Drive:
    """What moves a robot: the law of :mod:`frobs_sim_pybullet.law`.

    Args:
        articulation: The robot.
        physics_timestep: [s]
        gravity: [m/s²]
    """

    def __init__(self, articulation: Articulation, physics_timestep: float, gravity: Vector) -> None:
        self._robot, self._h = articulation, physics_timestep
        self._count = len(articulation.joints)
        self._size = articulation.offset + self._count
        self._lead = [0.0] * articulation.offset
        self._zeros = [0.0] * self._size
        self._solve = solver(self._size)
        self._limits = self._spread([joint.limits.effort for joint in articulation.placement.model.actuated_joints])
        self._armature = [float(getattr(joint, "armature", 0.0)) for joint in articulation.moving]
        self._passive = [joint.damping for joint in articulation.moving]  # of followers; the others have parameters
        self._reduction = self._followers()
        friction = [joint.friction for joint in articulation.moving]
        self._friction = Friction(friction, self._mass_at_zero(), physics_timestep) if any(friction) else None
        self._simple = self._reduction is None and self._friction is None
        self._states: Sequence[tuple[float, ...]] | None = None
        self._pushes: list[tuple[int, Vector, int, Vector, Vector, Vector]] = []
        self._gravity = gravity
        self._turned: tuple[Quat, Vector] | None = None
        self.efforts = [0.0] * self._count

    def _spread(self, values: Sequence[float]) -> list[float]:
        """Return values of the actuated joints in the order of the mass matrix; 0 for the others."""
        if self._robot.slots == list(range(self._count)):
            return list(values)
        full = [0.0] * self._count
        for slot, value in zip(self._robot.slots, values, strict=True):
            full[slot] = value
        return full

    def _followers(self) -> Floats | None:
        """Return the matrix from independent velocities to all, (size, independent); None: all are."""
        if not self._robot.mimics:
            return None
        offset = self._robot.offset
        whole = np.eye(self._size)
        for follower, leader, mimic in self._robot.mimics:
            whole[offset + follower, offset + leader] = mimic.multiplier
        return np.delete(whole, [offset + follower for follower, _, _ in self._robot.mimics], axis=1)

    def set_gravity(self, gravity: Vector) -> None:
        """Change what pulls [m/s²]."""
        self._gravity, self._turned = gravity, None

    def forget(self) -> None:
        """Read the state anew: it was written to."""
        self._states = self._turned = None

    def set_commands(self, kp: list[float], kd: list[float], damping: list[float]) -> None:
        """Set the gains and the joints' own damping, in the file's order, for the next physics steps."""
        self._kp, self._kd = self._spread(kp), self._spread(kd)
        self._damping = self._spread(damping)
        for follower, _, _ in self._robot.mimics:
            self._damping[follower] = self._passive[follower]
        self._free = self._simple and not (any(self._kd) or any(self._damping) or any(self._armature))

    def push(self, link: str, force: Vector, torque: Vector) -> None:
        """Push a link at its centre of mass in the next physics steps; in the world [N, N·m]."""
        body, offset = self._robot.bones.frames[link]
        index = self._robot.links[body]
        point = (0.0, 0.0, 0.0) if body == link else compose(invert(self._robot.coms[index]), offset)[0]
        on_link = self._robot.coms[index][0] if body == link else offset[0]
        self._pushes.append((index, point, self._robot.twin_links[body], on_link, force, torque))

    def stop_pushing(self) -> None:
        """Push no more."""
        self._pushes.clear()

    def states(self) -> tuple[list[float], list[float]]:
        """Return joint positions and velocities, in the file's order."""
        robot = self._robot
        states = self._states = p.getJointStates(robot.body, robot.joints, robot.client)
        return [states[slot][0] for slot in robot.slots], [states[slot][1] for slot in robot.slots]

    def __call__(self, command: list[float]) -> bool:
        """Set the efforts of the next physics step; return False where the state has diverged.

        Args:
            command: In the file's order: Kp·q*, Kd·v* or ff.
        """
        robot, h = self._robot, self._h
        states = self._states or p.getJointStates(robot.body, robot.joints, robot.client)
        self._states = None
        q, v = [state[0] for state in states], [state[1] for state in states]
        if not math.hypot(*v) < FASTEST:
            return False
        efforts, sums, diagonal = [], [], []
        for c, x, y, kp, kd, limit, damping, armature in zip(
            self._spread(command), q, v, self._kp, self._kd, self._limits, self._damping, self._armature, strict=True
        ):
            effort = c - kp * x - kd * y
            if effort >= limit:
                effort, kd = limit, 0.0
            elif effort <= -limit:
                effort, kd = -limit, 0.0
            efforts.append(effort)
            sums.append(effort - damping * y)
            diagonal.append(armature + h * (kd + damping))
        self.efforts = efforts
        torques = efforts if self._free else self._implicit(q, v, sums, diagonal)
        if torques is None:
            return False
        p.setJointMotorControlArray(
            robot.body, robot.joints, p.TORQUE_CONTROL, forces=torques, physicsClientId=robot.client
        )
        for index, point, _, _, force, torque in self._pushes:
            self._apply(index, point, force, torque)
        return True

    def _implicit(self, q: list[float], v: list[float], sums: list[float], diagonal: list[float]) -> list[float] | None:
        """Return the efforts with which Bullet arrives at the law's accelerations; None where the base has diverged."""
        robot = self._robot
        dynamics, twin = robot.dynamics, robot.twin
        if robot.offset:
            motion = self._base_motion()
            if not math.hypot(*motion) < FASTEST:
                return None
            q, v = self._lead + q, motion + v
            sums, diagonal = self._lead + sums, self._lead + diagonal
        elif self._turned is None:
            turn = robot.base()[1]
            self._turned = turn, rotate(conjugate(turn), self._gravity)
        assert self._turned is not None
        dynamics.set_gravity(self._turned[1])
        bias = p.calculateInverseDynamics(twin, q, v, self._zeros, 0, dynamics.client)
        mass = p.calculateMassMatrix(twin, q, 0, dynamics.client)
        right = [s - b for s, b in zip(sums, bias, strict=True)]
        pushed = [0.0] * self._size
        if self._pushes:
            pushed = self._pushed(q)
            right = [r + push for r, push in zip(right, pushed, strict=True)]
        if self._simple:
            accelerations = self._solve(mass, diagonal, right)
            return [s - d * a for s, d, a in zip(sums, diagonal, accelerations, strict=True)][robot.offset :]
        return self._general(np.array(mass), np.array(diagonal), np.array(right), v, np.subtract(bias, pushed))

    def _general(self, mass: Floats, diagonal: Floats, right: Floats, v: list[float], bias: Floats) -> list[float]:
        """Do the same with dry friction, and with joints that follow others."""
        if self._friction is not None:
            right = right + self._friction(mass, self._armature, right, v)
        whole = mass + np.diag(diagonal)
        if self._reduction is None:
            accelerations = np.linalg.solve(whole, right)
        else:
            follow = self._reduction
            accelerations = follow @ np.linalg.solve(follow.T @ whole @ follow, follow.T @ right)
        torques: list[float] = (mass @ accelerations + bias).tolist()
        return torques[self._robot.offset :]

    def _base_motion(self) -> list[float]:
        """Return lin and ang velocity of a free base's link frame, in its own axes."""
        robot = self._robot
        (com, turned), (lin, ang) = (
            p.getBasePositionAndOrientation(robot.body, robot.client),
            p.getBaseVelocity(robot.body, robot.client),
        )
        at, turn = compose((com, turned), robot.com_backs[-1])
        arm = cross(ang, (at[0] - com[0], at[1] - com[1], at[2] - com[2]))
        back = conjugate(turn)
        self._turned = turn, rotate(back, self._gravity)
        return [*rotate(back, (lin[0] + arm[0], lin[1] + arm[1], lin[2] + arm[2])), *rotate(back, ang)]

    def _mass_at_zero(self) -> Floats:
        zeros, dynamics = self._zeros, self._robot.dynamics
        return np.array(p.calculateMassMatrix(self._robot.twin, zeros, 0, dynamics.client))

    def _pushed(self, q: list[float]) -> list[float]:
        """Return what the pushes amount to in each column of the mass matrix."""
        robot, total = self._robot, np.zeros(self._size)
        assert self._turned is not None
        back = conjugate(self._turned[0])
        for _, _, link, point, force, torque in self._pushes:
            if link < 0:
                continue  # of a fixed base
            lin, ang = p.calculateJacobian(robot.twin, link, point, q, self._zeros, self._zeros, robot.dynamics.client)
            total += np.array(rotate(back, force)) @ np.array(lin) + np.array(rotate(back, torque)) @ np.array(ang)
        values: list[float] = total.tolist()
        return values

    def _apply(self, index: int, point: Vector, force: Vector, torque: Vector) -> None:
        robot = self._robot
        if index < 0:
            at, turn = p.getBasePositionAndOrientation(robot.body, robot.client)
        else:
            at, turn = p.getLinkState(robot.body, index, 0, 1, robot.client)[:2]
        x, y, z = cross(rotate(turn, point), force)
        turning = torque[0] + x, torque[1] + y, torque[2] + z
        p.applyExternalForce(robot.body, index, force, at, p.WORLD_FRAME, robot.client)
        p.applyExternalTorque(robot.body, index, turning, p.WORLD_FRAME, robot.client)

    def positions(self) -> list[float]:
        """Return all positions in the order of the mass matrix; a free base's are zero, in its own axes."""
        robot = self._robot
        states = self._states or p.getJointStates(robot.body, robot.joints, robot.client)
        return self._lead + [state[0] for state in states]

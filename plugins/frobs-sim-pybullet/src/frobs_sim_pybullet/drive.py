"""Computes the drive efforts of one robot in one environment at each physics step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import gt, lt

import numpy as np

from frobs_core.models import joint_path
from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.articulation import FASTEST, Articulation
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.constraints import Constraints
from frobs_sim_pybullet.general_law import GeneralLaw
from frobs_sim_pybullet.law import LARGEST, Law, law
from frobs_sim_pybullet.transforms import Quat, Vector, compose, conjugate, cross, invert, rotate
from frobs_sim_pybullet.urdf import position_range


class Drive:
    """A robot's drives, which follow the drive law in :mod:`frobs_sim_pybullet.law`."""

    def __init__(self, articulation: Articulation, physics_timestep: float, gravity: Vector) -> None:
        self._robot, self._h = articulation, physics_timestep
        self._count = len(articulation.joints)
        self._size = articulation.offset + self._count
        self._lead = [0.0] * articulation.offset
        self._zeros = [0.0] * self._size
        self._limits = self._spread([joint.limits.effort for joint in articulation.placement.model.actuated_joints])
        self._armature = [articulation.placement.armatures[joint.name] for joint in articulation.moving]
        # Used only for mimic joints. Actuated joints use the damping in the shared gains array.
        self._passive = [joint.damping for joint in articulation.moving]
        ends = [position_range(joint) or (-math.inf, math.inf) for joint in articulation.moving]
        self._lower, self._upper = [low for low, _ in ends], [high for _, high in ends]
        self._rubs = any(joint.friction for joint in articulation.moving)
        shares = _shares(articulation)
        fingers = _fingers(articulation, [(index, leader) for index, leader, _ in shares])
        for finger in fingers:  # without friction anchors, a held object slowly turns between the fingers
            link = articulation.joints[finger]
            p.changeDynamics(articulation.body, link, frictionAnchor=1, physicsClientId=articulation.client)
        self._pressing = shares if fingers else []
        self._pressing_joints = [articulation.joints[index] for index, _, _ in self._pressing]
        self._pressing_gains = [1.0] * len(self._pressing)
        self._simple = not (self._rubs or articulation.mimics or self._pressing)
        self._law_at_limits: Law | None = None
        self._law = self._choose_law()
        self._states: Sequence[tuple[float, ...]] | None = None
        self.pushes: list[tuple[int, Vector, int, Vector, Vector, Vector]] = []
        self._gravity = gravity
        self._seen_gains: bytes | None = None  # None means that no gains have been seen; a robot without joints has b""
        self._turned: tuple[Quat, Vector] | None = None
        self.efforts = [0.0] * self._count

    def _choose_law(self) -> Law:
        if self._simple and self._count and self._size <= LARGEST:
            return law
        return self._general_law(constrained=self._rubs)

    def _general_law(self, *, constrained: bool) -> Law:
        robot, constraints = self._robot, None
        if constrained:
            matrix = np.array(p.calculateMassMatrix(robot.twin, self._zeros, 0, robot.dynamics.client))
            inverse = np.linalg.inv(matrix + np.diag([0.0] * robot.offset + self._armature))
            friction = [joint.friction for joint in robot.moving]
            constraints = Constraints(friction, self._lower, self._upper, np.diag(inverse), self._h)
        return GeneralLaw(robot.offset, self._count, constraints, self._armature, robot.mimics)

    def _at_limits(self) -> Law:
        """Return the drive law that also handles joints beyond their limits. This law is created on first use."""
        if self._law_at_limits is None:
            self._law_at_limits = self._law if self._rubs else self._general_law(constrained=True)
        return self._law_at_limits

    def _spread(self, values: list[float]) -> list[float]:
        """Return the actuated joints' values in the order of the mass matrix, with 0 for all other joints."""
        if self._robot.in_order:
            return values
        full = [0.0] * self._count
        for slot, value in zip(self._robot.slots, values, strict=True):
            full[slot] = value
        return full

    def set_gravity(self, gravity: Vector) -> None:
        """Change the gravity [m/s²]."""
        self._gravity, self._turned = gravity, None

    def forget(self) -> None:
        """Discard the cached joint states after the state has been written."""
        self._states = self._turned = None

    def set_gains(self, gains: Floats) -> None:
        """Set Kp, Kd and the joint damping for the next physics steps, (3, dof), in the model file's order."""
        seen = gains.tobytes()
        if seen == self._seen_gains:
            return
        self._seen_gains = seen
        kp, kd, damping = (self._spread(values) for values in gains.tolist())
        for follower, _, _ in self._robot.mimics:
            damping[follower] = self._passive[follower]
        h = self._h
        inertia = [a + h * d for a, d in zip(self._armature, damping, strict=True)]
        self._constants = list(zip(kp, kd, self._limits, damping, inertia, [h * k for k in kd], strict=True))
        self._free = self._simple and not (any(kp) or any(kd) or any(inertia))

    def push(self, link: str, force: Vector, torque: Vector) -> None:
        """Apply a world-frame force [N] and torque [N·m] to a link's center of mass until :meth:`stop_pushing`."""
        body, offset = self._robot.bones.frames[link]
        index = self._robot.links[body]
        point = (0.0, 0.0, 0.0) if body == link else compose(invert(self._robot.coms[index]), offset)[0]
        on_twin = self._robot.on_twin(index, self._robot.coms[index][0] if body == link else offset[0])
        self.pushes.append((index, point, self._robot.twin_links[body], on_twin, force, torque))

    def stop_pushing(self) -> None:
        """Remove the applied forces."""
        self.pushes.clear()

    def states(self) -> tuple[list[float], list[float]]:
        """Return the positions and velocities of the actuated joints, in the model file's order."""
        robot = self._robot
        states = self._states = self._joint_states()
        return [states[slot][0] for slot in robot.slots], [states[slot][1] for slot in robot.slots]

    def _joint_states(self) -> Sequence[tuple[float, ...]]:
        """Return Bullet's joint states, or an empty tuple for a robot without joints, for which Bullet returns None."""
        robot = self._robot
        return p.getJointStates(robot.body, robot.joints, robot.client) or ()

    def applied(self) -> list[float]:
        """Return the efforts that the drives applied in the last physics step, in the model file's order."""
        return self.efforts if self._robot.in_order else [self.efforts[slot] for slot in self._robot.slots]

    def __call__(self, command: list[float]) -> bool:
        """Set the efforts for the next physics step, or return False if the state has diverged.

        Args:
            command: Command of each actuated joint (Kp·q*, Kd·v* or ff), in the model file's order.
        """
        robot = self._robot
        states = self._states or self._joint_states()
        self._states = None
        q, v = [state[0] for state in states], [state[1] for state in states]
        if not math.hypot(*v) < FASTEST:
            return False
        command = self._spread(command)
        beyond = any(map(lt, q, self._lower)) or any(map(gt, q, self._upper))
        if self._free and not beyond:
            torques = self.efforts = [
                min(limit, max(-limit, effort)) for effort, limit in zip(command, self._limits, strict=True)
            ]
        else:
            dynamics, twin, positions, velocities = robot.dynamics, robot.twin, q, v
            if robot.offset:
                motion = self._base_motion()
                if not math.hypot(*motion) < FASTEST:
                    return False
                positions, velocities = self._lead + q, motion + v
            turned = self._turned or self._turn()
            dynamics.set_gravity(turned[1])
            bias = p.calculateInverseDynamics(twin, positions, velocities, self._zeros, 0, dynamics.client)
            mass = p.calculateMassMatrix(twin, positions, 0, dynamics.client)
            if self.pushes:
                bias = np.subtract(bias, self._pushed(positions)).tolist()
            way = self._at_limits() if beyond else self._law
            torques, self.efforts = way(q, v, command, self._constants, mass, bias)
            if self._pressing:
                assert isinstance(way, GeneralLaw)  # see _simple
                self._press(v, way.accelerations, torques)
        p.setJointMotorControlArray(
            robot.body, robot.joints, p.TORQUE_CONTROL, forces=torques, physicsClientId=robot.client
        )
        for index, point, _, _, force, torque in self.pushes:
            self._apply(index, point, force, torque)
        return True

    def _press(self, v: Sequence[float], accelerations: Floats, torques: Sequence[float]) -> None:
        """Let Bullet's motors add the effort with which a robot with a gripper presses on an object.

        ``torques`` are the efforts for free motion. They account for the damping and are smaller than the efforts of
        the drives, for the light fingers much smaller. The motors do nothing in free motion, because the joints already
        reach their target speeds. Bullet solves motors and contacts together, so that a robot that touches an object
        presses with the whole effort of its drives.
        """
        speeds = [v[index] + self._h * accelerations[index] for index, _, _ in self._pressing]
        forces = [
            max(0.0, share * abs(self.efforts[leader]) - abs(torques[index])) for index, leader, share in self._pressing
        ]
        robot = self._robot
        p.setJointMotorControlArray(
            robot.body,
            self._pressing_joints,
            p.VELOCITY_CONTROL,
            targetVelocities=speeds,
            velocityGains=self._pressing_gains,
            forces=forces,
            physicsClientId=robot.client,
        )

    def _turn(self) -> tuple[Quat, Vector]:
        """Return a fixed base's orientation and the gravity vector in the base's frame."""
        turn = self._robot.base()[1]
        self._turned = turn, rotate(conjugate(turn), self._gravity)
        return self._turned

    def _base_motion(self) -> list[float]:
        """Return the linear and angular velocity of a free base's link frame, expressed in this frame."""
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

    def _pushed(self, positions: list[float]) -> Floats:
        """Return the generalized forces due to the applied forces, one for each column of the mass matrix."""
        robot, total = self._robot, np.zeros(self._size)
        assert self._turned is not None
        back = conjugate(self._turned[0])
        for _, _, link, point, force, torque in self.pushes:
            if link >= 0:  # forces do not move a fixed base
                zeros = self._zeros
                lin, ang = p.calculateJacobian(robot.twin, link, point, positions, zeros, zeros, robot.dynamics.client)
                total += np.array(rotate(back, force)) @ np.array(lin) + np.array(rotate(back, torque)) @ np.array(ang)
        return total

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
        """Return all positions in the order of the mass matrix, with zeros for the virtual joints of a free base."""
        states = self._states or self._joint_states()
        return self._lead + [state[0] for state in states]


def _fingers(articulation: Articulation, leaders: Sequence[tuple[int, int]]) -> list[int]:
    """Return the indices of the joints that move the fingers of a robot's grippers, but not the tool center point.

    ``leaders`` contains each joint's index and the index of the joint whose drive moves it.
    """
    model = articulation.placement.model
    tools = articulation.placement.robot.end_effectors.values()
    moving_the_tool = {joint.name for tool in tools for joint in joint_path(model, tool.tcp)}
    driven = {joint for tool in tools for joint in tool.closed} - moving_the_tool
    return [index for index, leader in leaders if articulation.moving[leader].name in driven]


def _shares(articulation: Articulation) -> list[tuple[int, int, float]]:
    """Return how the drives' efforts are distributed over the joints, as three numbers for each joint.

    These are its index, the index of the joint whose drive moves it (the same joint, or the leader of a mimic joint),
    and its share of the drive's effort.
    """
    shares = []
    mimics = [follower for follower, _, _ in articulation.mimics]
    for leader in [index for index in range(len(articulation.moving)) if index not in mimics]:
        followers = {index: mimic.multiplier for index, other, mimic in articulation.mimics if other == leader}
        total = 1.0 + sum(map(abs, followers.values()))
        shares += [(index, leader, 1.0 / total) for index in (leader, *followers)]
    return shares

"""Compares the force at which a free body in the task's scene slips out of the gripper."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.description import EndEffector
from frobs_core.kernel.env import RobotEnv
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_conjugate, quat_multiply, quat_rotate
from frobs_devkit.parity.free_bodies import Bounded, Experiment, Outcome, bodies_of, compare_bodies, not_applicable
from frobs_devkit.parity.result import Measurement
from frobs_devkit.parity.under_test import Subject

_CLOSING, _PRESSING, _HOLDING = 1.0, 0.5, 0.2  # [s]
_PRESS = 5.0  # normal force on each finger [body weights]
_GROWTH, _MOST = 10.0, 100.0  # growth of the pulling force [body weights/s], and maximum force [body weights]
_SLIPPED = 0.005  # [m] displacement in the gripper at which a body is considered to slip
_FREE = 0.01  # fraction of the fingers' stroke, near either end, in which the fingers cannot hold a body
_SUMMARY = (
    f"The gripper holds a free body of the task's scene in the air. Each finger presses on the body with a "
    f"force of {_PRESS:g} times its weight. A force that grows by {_GROWTH:g} body weights per second pulls the body "
    f"out of the gripper, parallel to the finger surfaces. The slip force is the force at which the body has moved by "
    f"{1e3 * _SLIPPED:g} mm in the gripper."
)


def slip(subjects: Sequence[Subject]) -> Measurement:
    """Compare the force at which each free body of the task slips out of the gripper."""
    tool = gripper_of(subjects[0])
    if tool is None:
        reason = "the robot has no gripper" if bodies_of(subjects[0]) else "the task has no free body"
        return not_applicable(subjects, _SUMMARY, reason)
    experiment = Experiment(
        quantities={"slip_force": ("slip force", "N")},
        curve="Motion",
        axes=("N", "mm"),
        unknown="the gripper does not hold the body",
        missing="not held",
    )
    return compare_bodies(subjects, _SUMMARY, experiment, partial(pull, tool=tool))


def gripper_of(subject: Subject) -> EndEffector | None:
    """Return the robot's first end effector that can close, or None."""
    tools = subject.placement.robot.end_effectors.values()
    return next((tool for tool in tools if tool.group and tool.closed), None)


def pull(subject: Subject, body: Bounded, tool: EndEffector) -> Outcome:
    """Pull a body out of the gripper. The curve shows its motion in the gripper over the force.

    The slip force is the largest force that was applied, or NaN if the gripper does not hold the body.
    """
    with subject.make() as env:
        env.reset(seed=0)
        timestep, weight = env.simulation.physics_timestep, body.mass * float(np.linalg.norm(subject.gravity))
        grasp = _Grasp(env, body, tool)
        held = grasp.close(_PRESS * weight)
        placed = grasp.offset()
        env.simulation.step(round(_HOLDING / timestep))
        start = grasp.offset()
        if not held or not np.linalg.norm(start - placed) < _SLIPPED:
            return Outcome({"slip_force": float("nan")}, np.zeros(0), np.zeros(0))
        forces, moved = [0.0], [0.0]
        while moved[-1] < _SLIPPED and forces[-1] < _MOST * weight:
            forces.append(forces[-1] + _GROWTH * weight * timestep)
            force = quat_rotate(env.robot.frame_pose(tool.tcp)[1], np.array([[0.0, 0.0, forces[-1]]]))
            env.simulation.apply_wrench(body.name, force, np.zeros((1, 3)))
            env.simulation.step(1)
            moved.append(float(np.linalg.norm(grasp.offset() - start)))
    return Outcome({"slip_force": forces[-1]}, np.array(forces), 1e3 * np.array(moved))


class _Grasp:
    """A body in a gripper whose fingers close along the y axis of the tool frame, after a reset of the environment."""

    def __init__(self, env: RobotEnv, body: Bounded, tool: EndEffector) -> None:
        self._simulation, self._robot, self._body, self._tcp = env.simulation, env.robot, body, tool.tcp
        self._handle = env.simulation.bodies[body.name]
        self._fingers = [env.robot.joint_names.index(joint) for joint in tool.closed]
        self._closed = np.array([tool.closed[joint] for joint in tool.closed])
        self._open = np.array([tool.open[joint] for joint in tool.closed])

    def close(self, press: float) -> bool:
        """Close the gripper, with the body's shortest edge between the fingers, and return whether the body stops them.

        The body is kept in place while the gripper closes. Each finger presses with a normal force [N].
        """
        robot, fingers = self._robot, self._fingers
        stroke = np.abs(self._open - self._closed).sum()  # [rad or m]
        command = robot.joint_positions.copy()
        command[:, fingers] = self._open
        robot.write_joint_state(command)
        robot.set_command_mode([CommandMode.EFFORT if i in fingers else CommandMode.POSITION for i in range(robot.dof)])
        turn = self._body.turned("y")[None]
        left = stroke / 2.0  # estimated remaining stroke, replaced by the measured value after the fingers stop
        for duration in (_CLOSING, _PRESSING):
            # By virtual work: if the joints moved the remaining distance, the gap would shrink by the body's width.
            command[:, fingers] = np.sign(self._closed - self._open) * press * self._body.edges[0] / left
            robot.command(command)
            for _ in range(round(duration / self._simulation.physics_timestep)):
                pos, quat = robot.frame_pose(self._tcp)
                turned = quat_multiply(quat, turn)
                self._handle.write_pose(self._body.origin(pos, turned), turned)
                self._simulation.step(1)
            left = np.abs(robot.joint_positions[0, fingers] - self._closed).sum()
            # If the fingers stop near an end of their stroke, the body is not between them or is too large.
            if not _FREE < left / stroke < 1.0 - _FREE:
                return False
        return True

    def offset(self) -> Floats:
        """Return the body's position in the tool frame, (3,) [m]."""
        pos, quat = self._robot.frame_pose(self._tcp)
        return np.asarray(quat_rotate(quat_conjugate(quat), self._handle.pose[0] - pos)[0])

"""Checks that frames, Jacobians and limits match the model file and are up to date."""

from __future__ import annotations

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnknownNameError
from frobs_core.util.rotations import quat_conjugate, quat_multiply
from frobs_devkit.testing.checks import Inconclusive, expect, expect_raises
from frobs_devkit.testing.compare import expect_close, expect_same, expect_same_pose, placed
from frobs_devkit.testing.simulator.robots import ARM
from frobs_devkit.testing.simulator.under_test import TILTED, SimulatorUnderTest, spread, verifies

_TOLERANCE = 1e-8


def joints_are_the_files(subject: SimulatorUnderTest) -> None:
    """Joint names, order, home position, limits and gains match the robot's files, with one row per environment."""
    with subject.build() as (sim, robot):
        model = robot.model
        expect(robot.joint_names == model.joint_names, f"joint_names is {robot.joint_names}, not {model.joint_names}.")
        expect(robot.dof == len(model.joint_names), f"dof is {robot.dof}, not {len(model.joint_names)}.")
        expect(robot.tcp == "tool", f"tcp is '{robot.tcp}', not 'tool'.")
        limits = [joint.limits for joint in model.actuated_joints]
        expected = {
            "home": [ARM.home[name] for name in model.joint_names],
            "position_lower": [limit.lower for limit in limits],
            "position_upper": [limit.upper for limit in limits],
            "velocity_limit": [limit.velocity for limit in limits],
            "effort_limit": [limit.effort for limit in limits],
        }
        for name, row in expected.items():
            subject.expect_each(row, getattr(robot, name), 1e-12, name)
        expect_close(
            robot.home, robot.joint_positions, subject.at_home, "joint_positions after a reset, compared with home"
        )
        gains = [np.tile([ARM.gains.of(name)[i] for name in model.joint_names], (sim.num_envs, 1)) for i in (0, 1)]  # type: ignore[union-attr]
        for name, gain, actual in zip(("Kp", "Kd"), gains, robot.drive_gains(), strict=True):
            expect_close(gain, actual, 1e-9, f"drive_gains(): {name}")


def frames_are_current(subject: SimulatorUnderTest) -> None:
    """Immediately after a step or write, frame poses match the joint positions, with scalar-first quaternions."""
    with subject.build(pose=TILTED) as (sim, robot):
        for frame in ("tcp", "upper", "base"):
            _expect_frame(robot, frame, "after a reset")
        start = robot.joint_positions.copy()
        for k in range(4):
            robot.command(robot.home + spread(-0.8, 0.8, (sim.num_envs, 2), seed=k))
            sim.step(7)
            for frame in ("tcp", "fore"):
                _expect_frame(robot, frame, f"after step {k + 1}")
        if np.abs(robot.joint_positions - start).max() < 1e-3:
            raise Inconclusive("no joint moved")
        if subject.level("teleport"):
            robot.write_joint_state(spread(-1.0, 1.0, (sim.num_envs, 2), seed=9))
            _expect_frame(robot, "tcp", "after write_joint_state")


def given_joints_leave_the_state(subject: SimulatorUnderTest) -> None:
    """``frame_pose(frame, joint_positions)`` accepts any number of joint vectors and does not change the state."""
    with subject.build(pose=TILTED) as (sim, robot):
        robot.command(robot.home + 0.3)
        sim.step(5)
        before = (robot.joint_positions.copy(), robot.joint_velocities.copy(), sim.time.copy(), _copy(robot, "tcp"))
        for count in (1, 5):
            given = spread(-2.0, 2.0, (count, 2), seed=count)
            expected = placed((TILTED.pos, TILTED.quat_wxyz), robot.model.frame_pose("tool", given))
            expect_same_pose(expected, robot.frame_pose("tcp", given), _TOLERANCE, f"{count} given vectors")
        after = (robot.joint_positions.copy(), robot.joint_velocities.copy(), sim.time.copy(), _copy(robot, "tcp"))
        expect_same(before, after, "the state after a call of frame_pose(frame, joint_positions)")
        if subject.level("teleport"):
            robot.write_base_pose(np.array([[1.0, 2.0, 3.0]]), np.array([[0.0, 1.0, 0.0, 0.0]]))
            actual = robot.frame_pose("tcp", given)
            expect_same_pose(
                expected, actual, _TOLERANCE, "5 given vectors after the base has moved from its initial pose"
            )


def jacobian_is_the_derivative(subject: SimulatorUnderTest) -> None:
    """``frame_jacobian`` is the derivative of ``frame_pose`` in world axes, with the linear rows first."""
    with subject.build(pose=TILTED) as (sim, robot):
        robot.command(robot.home + spread(-0.5, 0.5, (sim.num_envs, 2)))
        sim.step(40)
        q, h = robot.joint_positions.copy(), 1e-6
        for frame in ("tcp", "upper"):
            jacobian = robot.frame_jacobian(frame)
            expect(jacobian.shape == (sim.num_envs, 6, 2), f"frame_jacobian is {jacobian.shape}, not (n, 6, dof).")
            for joint in range(2):
                offset = h * np.eye(2)[joint]
                ahead, behind = robot.frame_pose(frame, q + offset), robot.frame_pose(frame, q - offset)
                turn = quat_multiply(ahead[1], quat_conjugate(behind[1]))
                twist = 2.0 * turn[:, 1:] * np.sign(turn[:, :1])  # small rotation vector in the world frame
                slope = np.concatenate([ahead[0] - behind[0], twist], axis=1) / (2.0 * h)
                expect_close(slope, jacobian[:, :, joint], 1e-6, f"frame_jacobian('{frame}'), column {joint}")


def frame_velocity_is_current(subject: SimulatorUnderTest) -> None:
    """Immediately after a step, ``frame_velocity`` equals the frame's Jacobian times the joint velocities."""
    with subject.build(pose=TILTED) as (sim, robot):
        fastest = 0.0
        for k in range(4):
            robot.command(robot.home + spread(-1.0, 1.0, (sim.num_envs, 2), seed=k))
            sim.step(5)
            for frame in ("tcp", "fore"):
                expected = (robot.frame_jacobian(frame) * robot.joint_velocities[:, None, :]).sum(-1)
                actual = np.concatenate(robot.frame_velocity(frame), axis=1)
                expect_close(expected, actual, _TOLERANCE, f"frame_velocity('{frame}') after step {k + 1}")
            fastest = max(fastest, float(np.abs(robot.joint_velocities).max()))
    if fastest <= 1e-2:
        raise Inconclusive("no joint moved")


def unknown_frames_refused(subject: SimulatorUnderTest) -> None:
    """A frame name that does not belong to a link raises UnknownNameError."""
    with subject.build() as (_, robot):
        for call in (robot.frame_pose, robot.frame_velocity, robot.frame_jacobian):
            with expect_raises(UnknownNameError, f"{call.__name__}('no_such_link')"):
                call("no_such_link")


@verifies("teleport")
def bases_are_placed(subject: SimulatorUnderTest) -> None:
    """A written base pose can be read back, moves all frames, and affects only environments selected by the mask."""
    with subject.build() as (sim, robot):
        mask = np.arange(sim.num_envs) == 0
        before = [part.copy() for part in robot.base_pose]
        tilted = np.array([TILTED.pos]), np.array([TILTED.quat_wxyz])
        robot.write_base_pose(*tilted, mask)
        for i in range(sim.num_envs):
            pose = tilted if mask[i] else (before[0][[i]], before[1][[i]])
            actual = robot.base_pose[0][[i]], robot.base_pose[1][[i]]
            expect_same_pose(pose, actual, _TOLERANCE, f"base_pose of environment {i}, after writing to environment 0")
        _expect_frame(robot, "tcp", "after write_base_pose")


def _copy(robot: RobotHandle, frame: str) -> tuple[Floats, Floats]:
    pos, quat = robot.frame_pose(frame)
    return pos.copy(), quat.copy()


def _expect_frame(robot: RobotHandle, frame: str, when: str) -> None:
    expected = placed(robot.base_pose, robot.model.frame_pose(robot.frame_name(frame), robot.joint_positions))
    expect_same_pose(expected, robot.frame_pose(frame), _TOLERANCE, f"frame_pose('{frame}') {when}")

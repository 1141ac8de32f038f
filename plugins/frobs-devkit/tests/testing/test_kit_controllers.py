"""Faults in a controller: a sound one with one thing broken."""

from __future__ import annotations

import sys
import weakref
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from frobs_controllers.joint_effort import JointEffort
from frobs_controllers.tcp_impedance import TcpImpedance
from frobs_core.contracts import CommandMode, Controller
from frobs_core.plugins.records import ControllerRecord, Level
from frobs_core.util.rotations import quat_difference
from frobs_devkit.testing import CheckFailure, check_controller, pytest_checks, run_checks


class Step(Controller):
    """Moves the commanded joint positions by up to 0.05 rad."""

    command_mode = CommandMode.POSITION

    def __init__(self, *, step: float = 0.05) -> None:
        self.step = step

    def bind(self, robot: Any, control_timestep: float, decimation: int) -> None:
        self.robot, self.decimation = robot, decimation
        self.action_space = gym.spaces.Box(-1.0, 1.0, (robot.dof,), np.float32)
        self.target = robot.home.copy()

    def reset(self, mask: Any) -> None:
        rows = slice(None) if mask is None else mask
        self.target[rows] = self.robot.joint_positions[rows]

    def apply(self, action: Any) -> Any:
        self.target = self.clip(self.target + self.step * np.clip(action, -1.0, 1.0))
        return self.target

    def clip(self, target: Any) -> Any:
        return np.clip(target, self.robot.position_lower, self.robot.position_upper)

    def snapshot(self) -> Any:
        return {"target": self.target.copy()}

    def restore(self, snapshot: Any) -> None:
        self.target = snapshot["target"].copy()


class PositionalKeyword(Step):
    def __init__(self, step: float = 0.05) -> None:
        super().__init__(step=step)


class LargeSpace(Step):
    def bind(self, *arguments: Any) -> None:
        super().bind(*arguments)
        self.action_space = gym.spaces.Box(-3.0, 3.0, (self.robot.dof,), np.float32)


class OneRowTooMany(Step):
    def apply(self, action: Any) -> Any:
        return np.repeat(super().apply(action)[:, None], self.decimation + 1, axis=1)


class Nan(Step):
    def apply(self, action: Any) -> Any:
        target = super().apply(action)
        return np.where(target > 0.3, np.nan, target)


class ActionIgnored(Step):
    def apply(self, action: Any) -> Any:
        return super().apply(0 * action)


class NeverRests(Step):
    def apply(self, action: Any) -> Any:
        return super().apply(action + 0.5 * np.sign(0.5 - self.target))


class FromTheMeasured(Step):
    """Adds to where the robot is, not to where it should be: it sinks a little with every step."""

    def apply(self, action: Any) -> Any:
        return self.clip(self.robot.joint_positions + self.step * np.clip(action, -1.0, 1.0))


class LimitIgnored(Step):
    def clip(self, target: Any) -> Any:
        return target


class NotClipped(Step):
    def apply(self, action: Any) -> Any:
        self.target = self.clip(self.target + self.step * action)
        return self.target


class WritesActions(Step):
    def apply(self, action: Any) -> Any:
        np.clip(action, -1.0, 1.0, out=action)
        return super().apply(action)


class ResetsAll(Step):
    def reset(self, mask: Any) -> None:
        super().reset(None)


class ResetsNothing(Step):
    def reset(self, mask: Any) -> None:
        if mask is None:
            super().reset(mask)


class MatrixProduct(Step):
    """What BLAS rounds depends on how many rows there are."""

    def apply(self, action: Any) -> Any:
        return super().apply(action) + 1e-12 * len(action)


class ForgetsTarget(Step):
    def snapshot(self) -> Any:
        return {}

    def restore(self, snapshot: Any) -> None:
        pass


class ModeIsAWord(Step):
    command_mode = "position"  # type: ignore[assignment]


class MovesTheRobot(Step):
    """Puts the joints where they are already, at rest: not its business."""

    def apply(self, action: Any) -> Any:
        target = super().apply(action)
        self.robot.write_base_pose(*(part.copy() for part in self.robot.base_pose))
        self.robot.command(target)
        return target


class StepsByColumn(Step):
    def apply(self, action: Any) -> Any:
        return super().apply(np.clip(action, -1.0, 1.0) * np.linspace(0.5, 1.0, action.shape[-1]))


class ByTheAlphabet(Step):
    def apply(self, action: Any) -> Any:
        ordered = np.empty_like(action)
        ordered[:, np.argsort(self.robot.joint_names)] = action
        return super().apply(ordered)


class OneStepLate(Step):
    def apply(self, action: Any) -> Any:
        before = self.target
        super().apply(action)
        return before


class ChangePerSecond(Step):
    """Goes where an action says, as fast as the joints can; and states how far an action may change in a second."""

    def __init__(self) -> None:  # without the parameter of the base class, which has no effect here
        super().__init__()

    def bind(self, robot: Any, control_timestep: float, decimation: int) -> None:
        super().bind(robot, control_timestep, decimation)
        self.fastest = robot.velocity_limit * control_timestep

    def apply(self, action: Any) -> Any:
        goal = self.robot.home + 0.3 + 0.5 * np.clip(action, -1.0, 1.0)
        self.target = self.clip(self.target + np.clip(goal - self.target, -self.fastest, self.fastest))
        return self.target

    @property
    def max_action_change(self) -> Any:
        return self.robot.velocity_limit[0] / 0.5


class SharedByAll(Step):
    last: weakref.ref[Any] = weakref.ref(Controller)

    def apply(self, action: Any) -> Any:
        other = SharedByAll.last()
        SharedByAll.last = weakref.ref(self)
        distracted = isinstance(other, Step) and other is not self
        return self.clip(super().apply(action) + 1e-3 * distracted)


class SnapshotOfObjects(Step):
    def snapshot(self) -> Any:
        return {**super().snapshot(), "robot": np.array([None] * len(self.target))}


class TellsForOne(Step):
    def info(self) -> Any:
        return {"planned": np.ones(1)}


class TellsInTurns(Step):
    turn = False

    def info(self) -> Any:
        self.turn = not self.turn
        return {"left" if self.turn else "right": np.ones(len(self.target))}


class Explicit(TcpImpedance):
    """Computes spring and damper from the current state alone, so that light wrists swing ever faster."""

    def update(self) -> Any:
        joints = self._joints
        pos, quat_wxyz = joints.frame_pose("tcp")
        error = np.concatenate([self._target_pos - pos, quat_difference(self._target_quat, quat_wxyz)], axis=1)
        velocity = np.concatenate(joints.frame_velocity("tcp"), axis=1)
        wrench = self._stiffness * error - self._damping * velocity
        efforts = (joints.frame_jacobian("tcp") * wrench[:, :, None]).sum(axis=1)
        efforts += self._dynamics(self._gravity)[1] - self.joint_damping * joints.joint_velocities
        return np.clip(efforts, -joints.effort_limit, joints.effort_limit)


class Creeps(JointEffort):
    """Adds an effort that nobody has commanded."""

    def apply(self, action: Any) -> Any:
        return super().apply(action) + 0.5


class Spring(Controller):
    """Moves the setpoints of springs with dampers and integrals, one per joint, which act at each physics step."""

    command_mode = CommandMode.EFFORT
    rate = "physics"

    def __init__(self, *, stiffness: float = 20.0, damping: float = 5.0, integral: float = 2.0) -> None:
        self.stiffness, self.damping, self.integral = stiffness, damping, integral

    def bind(self, joints: Any, control_timestep: float, decimation: int) -> None:
        self.joints, self.timestep = joints, control_timestep / decimation
        self.action_space = gym.spaces.Box(-1.0, 1.0, (joints.dof,), np.float32)
        self.target, self.sum = joints.home.copy(), np.zeros((joints.num_envs, joints.dof))

    def reset(self, mask: Any) -> None:
        rows = slice(None) if mask is None else mask
        self.target[rows], self.sum[rows] = self.joints.joint_positions[rows], 0.0

    def apply(self, action: Any) -> Any:
        target = self.target + 0.05 * np.clip(action, -1.0, 1.0)
        self.target = np.clip(target, self.joints.position_lower, self.joints.position_upper)
        return self.update()

    def update(self) -> Any:
        error = self.target - self.joints.joint_positions
        self.sum = self.sum + error * self.timestep
        effort = self.stiffness * error + self.integral * self.sum - self.damping * self.joints.joint_velocities
        return np.clip(effort, -self.joints.effort_limit, self.joints.effort_limit)

    def snapshot(self) -> Any:
        return {"target": self.target.copy(), "sum": self.sum.copy()}

    def restore(self, snapshot: Any) -> None:
        self.target, self.sum = snapshot["target"].copy(), snapshot["sum"].copy()


class RepeatsTheCommand(Spring):
    """Computes a command in ``apply``, and repeats it at each physics step."""

    def apply(self, action: Any) -> Any:
        super().apply(action)
        self.last = Spring.update(self)
        return self.last

    def update(self) -> Any:
        return getattr(self, "last", np.zeros_like(self.sum))


class DampsTheVelocityBefore(Spring):
    """Measures velocities in ``apply`` only."""

    def apply(self, action: Any) -> Any:
        self.measured = self.joints.joint_velocities.copy()
        return super().apply(action)

    def update(self) -> Any:
        effort = super().update() + self.damping * (self.joints.joint_velocities - self.measured)
        return np.clip(effort, -self.joints.effort_limit, self.joints.effort_limit)


class IntegratesSteps(Spring):
    """Adds up errors without the time in which they last."""

    def bind(self, *arguments: Any) -> None:
        super().bind(*arguments)
        self.timestep = 0.002


class IntegratesControlSteps(Spring):
    """Multiplies each physics step's error by the duration of a control step."""

    def bind(self, joints: Any, control_timestep: float, decimation: int) -> None:
        super().bind(joints, control_timestep, decimation)
        self.timestep = control_timestep


class BeginsAtHome(Step):
    def reset(self, mask: Any) -> None:
        rows = slice(None) if mask is None else mask
        self.target[rows] = self.robot.home[rows]


class FastInShortSteps(Step):
    """Believes that every control step lasts 40 ms."""

    def apply(self, action: Any) -> Any:
        goal = self.robot.home + 2.0 * np.clip(action, -1.0, 1.0)
        fastest = 0.04 * self.robot.velocity_limit
        self.target = self.clip(self.target + np.clip(goal - self.target, -fastest, fastest))
        return self.target


class OneCommandForTheRobot(Step):
    """Always commands two joints."""

    def apply(self, action: Any) -> Any:
        target = super().apply(action)
        return np.broadcast_to(target[:, :1], (len(target), 2)) if target.shape[1] == 1 else target


class DefaultStep(Step):
    def __init__(self, *, step: float = 0.05) -> None:
        super().__init__()


class OneJointReversed(Step):
    def apply(self, action: Any) -> Any:
        return super().apply(action * np.where(np.array(self.robot.joint_names) == "elbow", -1.0, 1.0))


def record(cls: type, **fields: Any) -> ControllerRecord:
    return ControllerRecord(name="mine", summary="", entry_point=f"{__name__}:{cls.__name__}", **fields)


@pytest.fixture(autouse=True)
def importable() -> None:
    assert sys.modules[__name__].Step is Step


test_a_sound_controller_passes = pytest_checks(check_controller(record(Step)), allow_inconclusive=False)
test_a_sound_controller_at_physics_rate_passes = pytest_checks(
    check_controller(record(Spring)), allow_inconclusive=False
)


@pytest.mark.parametrize(
    ("faulty", "check"),
    [
        (PositionalKeyword, "keywords_are_keyword_only"),
        (LargeSpace, "actions_are_normalized"),
        (OneRowTooMany, "commands_have_their_shape"),
        (Nan, "commands_have_their_shape"),
        (TellsForOne, "info_has_its_shape"),
        (TellsInTurns, "info_has_its_shape"),
        (ActionIgnored, "actions_matter"),
        (NeverRests, "zero_action_rests"),
        (FromTheMeasured, "zero_action_does_not_drift"),
        (LimitIgnored, "commands_stay_in_limits"),
        (FastInShortSteps, "commands_stay_in_limits"),
        (NotClipped, "actions_are_clipped"),
        (WritesActions, "apply_reads_only"),
        (MovesTheRobot, "apply_reads_only"),
        (SharedByAll, "controllers_share_nothing"),
        (SnapshotOfObjects, "snapshots_continue"),
        (ResetsAll, "reset_honours_the_mask"),
        (ResetsNothing, "reset_honours_the_mask"),
        (MatrixProduct, "rows_equal_singles"),
        (ForgetsTarget, "snapshots_continue"),
        (Explicit, "installed_robots_rest"),
        (Creeps, "installed_robots_rest"),
        (RepeatsTheCommand, "updates_read_the_state"),
        (DampsTheVelocityBefore, "updates_read_the_state"),
        (IntegratesSteps, "commands_depend_on_time"),
        (IntegratesControlSteps, "commands_depend_on_time"),
        (BeginsAtHome, "resets_start_where_the_robot_is"),
        (OneCommandForTheRobot, "parts_of_a_robot_are_controlled"),
        (DefaultStep, "parameters_count"),
        (OneJointReversed, "actions_have_the_order_of_the_group"),
    ],
)
def test_the_kit_catches(faulty: type, check: str) -> None:
    found = next(c for c in check_controller(record(faulty)) if c.name == check)
    with pytest.raises(CheckFailure):
        found.run()


SEPARATE = [
    (record(PositionalKeyword), "keywords_are_keyword_only"),
    (record(Step, needs={"levitation": Level.EXACT}), "needs_are_capabilities"),
    (record(LargeSpace), "actions_are_normalized"),
    (record(ModeIsAWord), "commands_have_their_shape"),
    (record(TellsForOne), "info_has_its_shape"),
    (record(ActionIgnored), "actions_matter"),
    (record(NeverRests), "zero_action_rests"),
    (record(FromTheMeasured), "zero_action_does_not_drift"),
    (record(LimitIgnored), "commands_stay_in_limits"),
    (record(NotClipped), "actions_are_clipped"),
    (record(WritesActions), "apply_reads_only"),
    (record(ResetsNothing), "reset_honours_the_mask"),
    (record(MatrixProduct), "rows_equal_singles"),
    (record(SharedByAll), "controllers_share_nothing"),
    (record(ForgetsTarget), "snapshots_continue"),
    (record(ByTheAlphabet), "actions_have_the_order_of_the_group"),
    (record(ChangePerSecond), "action_changes_are_followed"),
    (record(OneStepLate), "actions_act_in_their_step"),
    (record(StepsByColumn), "commands_have_the_order_of_the_group"),
    (record(Explicit), "installed_robots_rest"),
    (record(RepeatsTheCommand), "updates_read_the_state"),
    (record(IntegratesSteps), "commands_depend_on_time"),
    (record(BeginsAtHome), "resets_start_where_the_robot_is"),
    (record(OneCommandForTheRobot), "parts_of_a_robot_are_controlled"),
    (record(DefaultStep), "parameters_count"),
]
"""Faults that one check catches, and no other."""


@pytest.mark.slow
@pytest.mark.parametrize(("faulty", "check"), SEPARATE, ids=[check for _, check in SEPARATE])
def test_no_other_check_catches(faulty: ControllerRecord, check: str) -> None:
    report = run_checks(check_controller(faulty))
    assert [result.name for result in report.failed] == [check]


def test_every_check_has_a_fault_that_no_other_catches() -> None:
    assert {check for _, check in SEPARATE} == {check.name for check in check_controller(record(Step))}

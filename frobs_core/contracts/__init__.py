"""Contracts of the five kinds of plugins: the abstract classes that they implement, and helpers to implement them."""

from frobs_core.contracts.algorithm import Algorithm, TrainingMonitor
from frobs_core.contracts.applied_wrenches import AppliedWrenches, Wrench
from frobs_core.contracts.body_handle import BodyHandle
from frobs_core.contracts.contacts import ContactState
from frobs_core.contracts.control import Control, RobotControl, joint_groups
from frobs_core.contracts.controller import Controller
from frobs_core.contracts.goal_task import GoalTask, PositionGoalTask, distance_between, position_goal_rewards
from frobs_core.contracts.joint_group import JointGroup, JointSubset
from frobs_core.contracts.measured import MeasuredBody, MeasuredRobot, MeasuredSimulation
from frobs_core.contracts.model_reader import ModelReader
from frobs_core.contracts.pacing import Pacer
from frobs_core.contracts.policy import Expert, Operator, Policy
from frobs_core.contracts.robot_handle import RobotHandle, active_gains
from frobs_core.contracts.simulation import BareEngine, Simulation
from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.contracts.step_context import StepContext
from frobs_core.contracts.task import Fitted, ResetOptions, Task
from frobs_core.contracts.viewer import Viewer
from frobs_core.description.robot import CommandMode

__all__ = [
    "Algorithm",
    "AppliedWrenches",
    "BareEngine",
    "BodyHandle",
    "CommandMode",
    "ContactState",
    "Control",
    "Controller",
    "Expert",
    "Fitted",
    "GoalTask",
    "JointGroup",
    "JointSubset",
    "MeasuredBody",
    "MeasuredRobot",
    "MeasuredSimulation",
    "ModelReader",
    "Operator",
    "Pacer",
    "Policy",
    "PositionGoalTask",
    "ResetOptions",
    "RobotControl",
    "RobotHandle",
    "Simulation",
    "Snapshot",
    "Stateful",
    "StepContext",
    "Task",
    "TrainingMonitor",
    "Viewer",
    "Wrench",
    "active_gains",
    "distance_between",
    "joint_groups",
    "position_goal_rewards",
]

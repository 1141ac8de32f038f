"""Interfaces that the five kinds of plugins implement."""

from frobs_core.interfaces.algorithm import Algorithm, TrainingMonitor
from frobs_core.interfaces.applied_wrenches import AppliedWrenches, Wrench
from frobs_core.interfaces.bodies import AT_REST, Body, Shape, Twist
from frobs_core.interfaces.body_handle import BodyHandle
from frobs_core.interfaces.command import CommandMode
from frobs_core.interfaces.contacts import ContactState
from frobs_core.interfaces.controller import Controller, ControllerWrapper
from frobs_core.interfaces.expert import Expert, load_expert
from frobs_core.interfaces.joint_group import JointGroup, JointSubset
from frobs_core.interfaces.pacing import Pacer
from frobs_core.interfaces.parameters import WrittenParameters
from frobs_core.interfaces.robot import ALL, DifferentialDrive, DriveGains, EndEffector, Robot
from frobs_core.interfaces.robot_handle import RobotHandle, active_gains
from frobs_core.interfaces.scene import Attachment, Camera, Contact, Marker, Placement, Prop, Scene
from frobs_core.interfaces.sensor import SENSORS, Bumper, ForceTorque, Imu, Lidar, Sensor
from frobs_core.interfaces.simulation import BareEngine, Simulation, Snapshot
from frobs_core.interfaces.step_context import StepContext
from frobs_core.interfaces.task import GoalTask, ResetOptions, Task
from frobs_core.interfaces.translation import Overlap, Translation, TranslationTable, read_tables, translate
from frobs_core.observation import Observation

__all__ = [
    "ALL",
    "AT_REST",
    "SENSORS",
    "Algorithm",
    "AppliedWrenches",
    "Attachment",
    "BareEngine",
    "Body",
    "BodyHandle",
    "Bumper",
    "Camera",
    "CommandMode",
    "Contact",
    "ContactState",
    "Controller",
    "ControllerWrapper",
    "DifferentialDrive",
    "DriveGains",
    "EndEffector",
    "Expert",
    "ForceTorque",
    "GoalTask",
    "Imu",
    "JointGroup",
    "JointSubset",
    "Lidar",
    "Marker",
    "Observation",
    "Overlap",
    "Pacer",
    "Placement",
    "Prop",
    "ResetOptions",
    "Robot",
    "RobotHandle",
    "Scene",
    "Sensor",
    "Shape",
    "Simulation",
    "Snapshot",
    "StepContext",
    "Task",
    "TrainingMonitor",
    "Translation",
    "TranslationTable",
    "Twist",
    "Wrench",
    "WrittenParameters",
    "active_gains",
    "load_expert",
    "read_tables",
    "translate",
]

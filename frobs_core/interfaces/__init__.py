"""What each of the five kinds is: the contracts that plugins implement."""

from frobs_core.interfaces.algorithm import Algorithm, TrainingMonitor
from frobs_core.interfaces.command import CommandMode
from frobs_core.interfaces.controller import Controller
from frobs_core.interfaces.parameters import WrittenParameters
from frobs_core.interfaces.robot import DifferentialDrive, DriveGains, Robot
from frobs_core.interfaces.scene import Body, Camera, Contact, Marker, Placement, Scene
from frobs_core.interfaces.sensor import Bumper, Imu, Lidar, Sensor
from frobs_core.interfaces.simulation import BareEngine, BodyHandle, RobotHandle, Simulation, Snapshot
from frobs_core.interfaces.task import GoalTask, Observation, ResetOptions, Task
from frobs_core.interfaces.translation import Overlap, Translation, TranslationTable, read_tables, translate

__all__ = [
    "Algorithm",
    "BareEngine",
    "Body",
    "BodyHandle",
    "Bumper",
    "Camera",
    "CommandMode",
    "Contact",
    "Controller",
    "DifferentialDrive",
    "DriveGains",
    "GoalTask",
    "Imu",
    "Lidar",
    "Marker",
    "Observation",
    "Overlap",
    "Placement",
    "ResetOptions",
    "Robot",
    "RobotHandle",
    "Scene",
    "Sensor",
    "Simulation",
    "Snapshot",
    "Task",
    "TrainingMonitor",
    "Translation",
    "TranslationTable",
    "WrittenParameters",
    "read_tables",
    "translate",
]

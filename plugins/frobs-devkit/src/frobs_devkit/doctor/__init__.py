"""Facts and findings that ``frobs doctor`` reports about a robot's file or a plugin.

robot_report.py   the facts and the findings, as data
reading.py        reads the file more leniently than a simulation
joints.py         limits, drives, efforts against gravity, possible tool links and their reach
bodies.py         masses, inertias, shapes
simulators.py     how each installed simulator represents the robot
robot.py          combines all facts and findings in a report
plugins.py        the installed plugins, each imported in its own process
"""

from frobs_devkit.doctor.plugins import PluginFacts, examine_plugins
from frobs_devkit.doctor.robot import examine_robot
from frobs_devkit.doctor.robot_report import (
    Difference,
    DriveFacts,
    Finding,
    JointFacts,
    LinkFacts,
    RobotReport,
    Severity,
    SimulatorFacts,
    ToolCandidate,
    TranslatedElement,
)

__all__ = [
    "Difference",
    "DriveFacts",
    "Finding",
    "JointFacts",
    "LinkFacts",
    "PluginFacts",
    "RobotReport",
    "Severity",
    "SimulatorFacts",
    "ToolCandidate",
    "TranslatedElement",
    "examine_plugins",
    "examine_robot",
]

"""What is wrong with a robot's file or a plugin, and what to do: the facts and findings of ``frobs doctor``.

report.py       the facts and the findings, as data
reading.py      reads the file, further than a simulation would
joints.py       limits, drives, weight
bodies.py       masses, inertias, shapes
tools.py        which link may be the tool, and how far it reaches
simulators.py   what each installed simulator makes of it
robot.py        puts it together
plugins.py      the installed plugins, each imported in a process of its own
"""

from frobs_devkit.doctor.plugins import PluginFacts, examine_plugins
from frobs_devkit.doctor.report import (
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
from frobs_devkit.doctor.robot import examine_robot

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

"""Examines a robot's file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from frobs_core import plugins
from frobs_core.description import Robot
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import Note, RobotModel, Treatment, home_positions
from frobs_core.util.errors import UnsuitableRobotError, check_name
from frobs_devkit.doctor.bodies import body_findings, link_facts
from frobs_devkit.doctor.joints import joint_facts, joint_findings, tool_candidates, tool_findings
from frobs_devkit.doctor.reading import read
from frobs_devkit.doctor.robot_report import Finding, RobotReport, Severity
from frobs_devkit.doctor.simulators import simulator_facts, simulator_findings
from frobs_models import Gripper, find_gripper, robot_bounds

_NAMED = re.compile(r'^<([\w:]+) name="(.*)">$')
_ADVICE = {
    Treatment.KEPT: "fix the element in the file",
    Treatment.APPROXIMATED: "specify the value in the file, so that FRobs does not have to assume one",
    Treatment.DROPPED: "fix the element in the file, or remove it",
}
_ADVICE_OF = {
    "unknown": "correct the name of the element or attribute, or remove it",
    "repeated-material": "give each material a name of its own",
    "mesh-mass": "add an <inertial> to the body",
}
_ARM = 4  # minimum number of actuated joints of an arm with a gripper
_ORDER = (Severity.ERROR, Severity.WARNING, Severity.NOTE)


def examine_robot(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
    simulators: Sequence[str] = (),
    gripper: Mapping[str, Any] | None = None,
    attach: str | None = None,
) -> RobotReport:
    """Examine a robot's file: its contents, its problems, and the robot's representation in each simulator.

    Args:
        path: A URDF, xacro or MJCF file, ``"package:relative/path"`` inside an installed Python package, a robot file
            (:mod:`frobs_core.kernel.robot_file`), or the name of a registered robot.
        xacro_args: Arguments of a xacro file.
        package_paths: Folders of the ROS packages that the file refers to, by package name.
        simulators: Names of the simulators to check. Defaults to all installed simulators.
        gripper: Known properties of the gripper; see :class:`~frobs_core.kernel.robot_config.RobotKeywords`.
        attach: Gripper to mount on the robot; see the same class.

    Returns:
        Facts and findings. The robot is examined in its home position. Joints without a declared home position rest at
        0, or at the middle of their limits if 0 is outside the limits.

    Raises:
        ModelFileError: The file cannot be read at all. The error message contains the line number and a suggested fix.
        UnknownNameError: A simulator, or a joint or link that is stated, does not exist.
        ConfigurationError: A statement about the gripper is invalid.
    """
    given: dict[str, Any] = {"gripper": gripper or {}, "attach": attach, "xacro_args": xacro_args or {}}
    paths = {name: str(folder) for name, folder in (package_paths or {}).items()}
    config = RobotConfig(robot=str(path), package_paths=paths, **given)
    is_plain = not attach and not config.is_file and config.robot not in plugins.records("robot")
    own = Robot(model=str(path)) if is_plain else config.describe()
    reading = read(own.model, own.xacro_args, own.package_paths)
    model = reading.model
    home = home_positions(model, own.home)
    if own.tcp is not None:
        check_name(f"link of '{model.name}'", own.tcp, [link.name for link in model.links])
    joints, links, tools = joint_facts(model, home), link_facts(model), tool_candidates(model, own.tcp)
    asked = simulator_facts(model, simulators, own.home)
    findings = [
        *reading.findings,
        *joint_findings(model, joints),
        *body_findings(model),
        *simulator_findings(model, asked),
        *_notes(model),
        *(() if own.tcp else tool_findings(model, tools)),
    ]
    findings.sort(key=lambda finding: _ORDER.index(finding.severity))
    low, high = robot_bounds(model, home)
    found, no_gripper = _gripper(model, config.gripper)
    return RobotReport(
        file=str(model.path),
        file_format=model.format,
        name=model.name,
        usable=all(finding.severity is not Severity.ERROR for finding in findings),
        dof=len(model.joint_names),
        root=model.root,
        mass=sum(link.mass or 0.0 for link in links),
        size=tuple((high - low).tolist()),
        findings=tuple(findings),
        joints=joints,
        links=links,
        tools=tools,
        gripper=found,
        no_gripper=no_gripper,
        differences=tuple(reading.differences),
        simulators=asked,
    )


def _gripper(model: RobotModel, stated: Any) -> tuple[Gripper | None, str]:
    """Return the gripper of an arm, or the reason why it has none."""
    if len(model.joint_names) < _ARM and not stated:
        return None, f"an arm with a gripper has at least {_ARM} actuated joints"
    try:
        return find_gripper(model, stated), ""
    except UnsuitableRobotError as error:
        return None, error.reason.rstrip(".")


def _notes(model: RobotModel) -> Iterator[Finding]:
    for note in model.notes:
        match = _NAMED.match(note.element)
        severity = Severity.WARNING if note.fault else Severity.NOTE
        about = f"{match[1]} '{match[2]}'" if match else note.element
        yield Finding(note.rule, severity, about, note.text, note_advice(note) if note.fault else "", note.line)


def note_advice(note: Note) -> str:
    """Return how to fix the fault of a model file that a note describes."""
    return _ADVICE_OF.get(note.rule, _ADVICE[note.treatment])

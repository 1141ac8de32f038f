"""Examines a robot's file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from frobs_core import plugins
from frobs_core.description import Robot
from frobs_core.models import RobotModel, Treatment, home_positions
from frobs_devkit.doctor.bodies import body_findings, link_facts
from frobs_devkit.doctor.joints import joint_facts, joint_findings
from frobs_devkit.doctor.reading import read
from frobs_devkit.doctor.robot_report import Finding, RobotReport, Severity
from frobs_devkit.doctor.simulators import simulator_facts, simulator_findings
from frobs_devkit.doctor.tools import tool_candidates, tool_findings
from frobs_models import robot_bounds

_NAMED = re.compile(r'^<([\w:]+) name="(.*)">$')
_ADVICE = {
    Treatment.KEPT: "fix the element in the file",
    Treatment.APPROXIMATED: "specify the value in the file, so that FRobs does not have to assume one",
    Treatment.DROPPED: "fix the element in the file, or remove it",
}
_ORDER = (Severity.ERROR, Severity.WARNING, Severity.NOTE)


def examine_robot(
    path: str | Path,
    *,
    xacro_args: Mapping[str, str] | None = None,
    package_paths: Mapping[str, str | Path] | None = None,
    simulators: Sequence[str] = (),
) -> RobotReport:
    """Examine a robot's file: its contents, its problems, and the robot's representation in each simulator.

    Args:
        path: A URDF, xacro or MJCF file, ``"package:relative/path"`` inside an installed Python package, or the name of
            a registered robot.
        xacro_args: Arguments of a xacro file.
        package_paths: Folders of the ROS packages that the file refers to, by package name.
        simulators: Names of the simulators to check. Defaults to all installed simulators.

    Returns:
        Facts and findings. The robot is examined in its home position. Joints without a declared home position rest at
        0, or at the middle of their limits if 0 is outside the limits.

    Raises:
        ModelFileError: The file cannot be read at all. The error message contains the line number and a suggested fix.
        UnknownNameError: A simulator does not exist.
    """
    own = (
        plugins.get_record("robot", str(path)).load()
        if str(path) in plugins.records("robot")
        else Robot(model=str(path))
    )
    reading = read(own.model, {**own.xacro_args, **(xacro_args or {})}, {**own.package_paths, **(package_paths or {})})
    model = reading.model
    home = home_positions(model, own.home)
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
        differences=tuple(reading.differences),
        simulators=asked,
    )


def _notes(model: RobotModel) -> Iterator[Finding]:
    """Yield one finding for each note of the file reader: a warning if the file should be fixed, otherwise a note."""
    for note in model.notes:
        match = _NAMED.match(note.element)
        yield Finding(
            code=note.rule,
            severity=Severity.WARNING if note.fault else Severity.NOTE,
            about=f"{match[1]} '{match[2]}'" if match else note.element,
            problem=note.text,
            advice=_ADVICE[note.treatment] if note.fault else "",
            line=note.line,
        )

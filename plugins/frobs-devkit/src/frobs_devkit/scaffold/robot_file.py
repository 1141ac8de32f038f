"""Derives a new robot's description from its model file, and copies the file with everything that it refers to."""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import UnknownNameError
from frobs_core.interfaces import Robot
from frobs_core.models import Joint, RobotModel, default_tcp, home_positions, load_model
from frobs_core.random import RandomSource
from frobs_devkit.scaffold.errors import AnswerError

if TYPE_CHECKING:
    from frobs_devkit.testing import Report

_CLEARANCE = 0.05  # [m] minimum height of the joints above the floor at the start of episodes
_POSTURES = 2048
_FATAL = ("model_has_joints", "tcp_moves")
_SIMULATOR = "mujoco"
_LICENSES = ("LICEN[CS]E*", "COPYING*", "COPYRIGHT*")
_LICENSE_FOLDERS = 5  # number of folders to search, from the file upward


@dataclass(frozen=True, kw_only=True)
class RobotFacts:
    """Data derived from a robot's model file.

    Attributes:
        model: The parsed file.
        model_name: Name of the file in the plugin.
        summary: One line for lists.
        tcp: The tool center point.
        home: Home position by joint [rad or m], without joints that rest at their default.
        joints: The actuated joints, one line each.
        expected_failures: Reason for each expected failure of a conformance check, by the check's name.
        report: Findings of the doctor and the file's license, as Markdown.
        license: License text of the model file and its meshes, or what is known about it.
    """

    model: RobotModel
    model_name: str
    summary: str
    tcp: str
    home: Mapping[str, float]
    joints: tuple[str, ...]
    expected_failures: Mapping[str, str]
    report: str
    license: str


def facts_for(context: Mapping[str, Any]) -> RobotFacts:
    """Return the data for a robot's description from the file in the answers.

    Args:
        context: The answers. If cookiecutter asked for them, relative paths refer to its output folder.
    """
    file = Path(context.get("_output_dir", ""), Path(context["robot_file"]).expanduser())
    keys = ("name", "tcp", "xacro_args", "package_paths", "failing_checks")
    return facts_of(robot_file=str(file), **{key: context[key] for key in keys})


@lru_cache(maxsize=8)
def facts_of(
    *,
    robot_file: str,
    name: str,
    tcp: str = "",
    xacro_args: str = "",
    package_paths: str = "",
    failing_checks: str = "reject",
) -> RobotFacts:
    """Return the data for a robot's description from its file.

    Args:
        robot_file: A URDF, xacro or MJCF file.
        name: Name of the robot.
        tcp: The tool center point; empty: the likeliest link.
        xacro_args: ``"a:=1 b:=2"``
        package_paths: ``"FOLDER"`` or ``"NAME=FOLDER"``; several are separated like paths in ``PATH``.
        failing_checks: What to do if the conformance kit fails on the robot: ``"reject"`` it, or ``"expect"`` the
            failures in the plugin's tests.
            in the tests of the plugin.

    Raises:
        ModelFileError: The file cannot be read.
        AnswerError: The doctor finds an error, or the conformance kit fails on the robot.
        UnknownNameError: ``tcp`` is not a link.
    """
    from frobs_cli import model_options
    from frobs_devkit.doctor import Severity, examine_robot

    args = model_options.xacro_args([xacro_args])
    paths = model_options.package_paths([part for part in package_paths.split(os.pathsep) if part])
    found = examine_robot(robot_file, xacro_args=args, package_paths=paths)
    for finding in found.findings:
        if finding.severity is Severity.ERROR:
            raise AnswerError(f"{robot_file}: {finding.about}: {finding.problem}; {finding.advice}.")
    model = load_model(robot_file, xacro_args=args, package_paths=paths)
    links = [link.name for link in model.links]
    if tcp and tcp not in links:
        raise UnknownNameError(f"link of '{model.name}'", tcp, links)
    tool = tcp or default_tcp(model)
    home = _home(model, tool) if model.joint_names else {}
    model_name = f"{name}.xml" if model.format == "mjcf" else f"{name}.urdf"
    with tempfile.TemporaryDirectory() as folder:
        copy_model(model, Path(folder) / model_name)
        checks = _check(Robot(model=str(Path(folder) / model_name), name=name, home=home, tcp=tool))
    failures = {result.name: result.message for result in checks.failed}
    is_fatal = not failures.keys().isdisjoint(_FATAL)
    if is_fatal or (failures and failing_checks == "reject"):
        told = " ".join(f"{check}: {' '.join(message.split())}" for check, message in failures.items())
        way_out = "" if is_fatal else ", or accept the failures with --failing-checks expect"
        raise AnswerError(
            f"{robot_file}: the conformance kit fails on the robot. {told} "
            f"Fix the file with the advice of 'frobs doctor robot'{way_out}."
        )
    warnings = [f"- {f.about}: {f.problem}; {f.advice}" for f in found.findings if f.severity is Severity.WARNING]
    report = f"Taken from `{Path(robot_file).name}`: {found.dof} joints, {found.mass:.3g} kg, tool `{tool}`."
    if warnings:
        report += " Findings of `frobs doctor robot`:\n\n" + "\n".join(warnings)
    source, license = find_license(Path(robot_file))
    report += f"\n\nThe license of the file and its meshes is not that of this package. {source}\n"
    return RobotFacts(
        model=model,
        model_name=model_name,
        summary=f"{found.dof} joints, from {Path(robot_file).name}".replace('"', "'").replace("\\", "/"),
        tcp=tool,
        home=home,
        joints=tuple(map(_describe, model.actuated_joints)),
        expected_failures={name: _shortened(message) for name, message in failures.items()},
        report=report,
        license=license,
    )


def find_license(file: Path) -> tuple[str, str]:
    """Return the location of a model file's license, in one sentence, and its text.

    Args:
        file: The model file. The license is searched beside it and in its parent folders, up to the root of a
            repository.
    """
    declared = ""
    for folder in list(file.resolve().parents)[:_LICENSE_FOLDERS]:
        found = sorted(path for pattern in _LICENSES for path in folder.glob(pattern) if path.is_file())
        if found:
            return f"It is in `MODEL_LICENSE`, a copy of `{found[0].name}`.", found[0].read_text(
                "utf-8", errors="replace"
            )
        manifest = folder / "package.xml"
        if not declared and manifest.is_file():
            declared = ", ".join(
                re.findall(r"<license\b[^>]*>([^<]*)</license>", manifest.read_text("utf-8", "replace"))
            )
        if (folder / ".git").exists():
            break
    if declared:
        text = f"The ROS package of the model declares the license: {declared}. Replace this file with its text."
        return f"The ROS package declares: {declared}. Put its text into `MODEL_LICENSE`.", f"{text}\n"
    text = (
        "No license was found beside the model file. Ask the authors of the model and its meshes for their license, and replace\n"
        "this file with its text before you distribute the package.\n"
    )
    return (
        "**None was found**: ask for it, and put it into `MODEL_LICENSE` before you distribute the package.",
        text,
    )


def copy_model(model: RobotModel, file: Path) -> None:
    """Write a robot's model file with expanded macros, and copy the meshes and textures that it refers to.

    Args:
        model: The parsed model.
        file: File to write. Files that it refers to are copied to ``meshes`` beside it.
    """
    root = ElementTree.fromstring(model.xml)
    taken: dict[Path, str] = {}
    for element in root.iter():
        for attribute in ("filename", "file"):
            source = Path(element.get(attribute, "").removeprefix("file://"))
            if source.is_absolute() and source.is_file():
                element.set(attribute, f"meshes/{_take(source, file.parent / 'meshes', taken)}")
    compiler = root.find("compiler")
    if compiler is not None:
        for attribute in ("meshdir", "texturedir", "assetdir"):
            compiler.attrib.pop(attribute, None)
    ElementTree.indent(root)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(ElementTree.tostring(root, encoding="unicode") + "\n", "utf-8")


def _take(source: Path, folder: Path, taken: dict[Path, str]) -> str:
    """Copy a file into a folder once, under a unique name."""
    if source not in taken:
        name, number = source.name, 1
        while name in taken.values():
            number += 1
            name = f"{source.stem}_{number}{source.suffix}"
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / name)
        taken[source] = name
        if source.suffix.lower() == ".obj":
            for line in source.read_text(errors="replace").splitlines():
                material = source.parent / line.removeprefix("mtllib ").strip()
                beside = material.resolve().is_relative_to(source.parent.resolve())
                if line.startswith("mtllib ") and beside and material.is_file():
                    shutil.copyfile(material, folder / material.name)
    return taken[source]


def _check(robot: Robot) -> Report:
    from frobs_core import plugins
    from frobs_devkit.testing import check_robot, run_checks

    simulators = [_SIMULATOR] if _SIMULATOR in plugins.records("simulator") else []
    return run_checks(check_robot(robot, simulators=simulators))


def _home(model: RobotModel, tool: str) -> dict[str, float]:
    """Return the home position: empty if the default is suitable, otherwise the nearest posture off the floor."""
    default = home_positions(model, {})
    if _height(model, tool, default[None])[0] > _CLEARANCE:
        return {}
    low = np.array([max(joint.limits.lower, -math.pi) for joint in model.actuated_joints])
    high = np.array([min(joint.limits.upper, math.pi) for joint in model.actuated_joints])
    postures = RandomSource(1).uniform("home", low, high, (_POSTURES, len(low)))[0]
    postures = default + np.linspace(0.0, 1.0, _POSTURES)[:, None] * (
        postures - default
    )  # nearest to the default first
    postures = np.clip(np.round(postures, 2), np.ceil(low * 100) / 100, np.floor(high * 100) / 100)
    clear = _height(model, tool, postures) > _CLEARANCE
    if not clear.any():
        return {}
    chosen = postures[int(clear.argmax())].tolist()
    return dict(zip(model.joint_names, chosen, strict=True))


def _height(model: RobotModel, tool: str, postures: Floats) -> Floats:
    """Return the height of the lowest joint after the first, or of the tool, (k,) [m]."""
    frames = [joint.child for joint in model.actuated_joints[1:]] + [tool]
    return np.asarray(np.min([model.frame_pose(frame, postures)[0][:, 2] for frame in frames], axis=0))


def _describe(joint: Joint) -> str:
    lower, upper = joint.limits.lower, joint.limits.upper
    bounded = math.isfinite(lower) or math.isfinite(upper)
    return f"``{joint.name}``: {joint.type.value}, {f'{lower:g} to {upper:g}' if bounded else 'without limits'}"


def _shortened(message: str) -> str:
    line = " ".join(message.split())
    return line if len(line) <= 80 else f"{line[:79]}…"

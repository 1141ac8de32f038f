"""Derives a new robot's description from its model file, and copies the model file with all referenced files."""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from frobs_core.description import DriveGains, Robot
from frobs_core.models import Joint, RobotModel, default_tcp, find_reader, home_positions
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnknownNameError
from frobs_core.util.random import RandomSource
from frobs_devkit.scaffold.errors import AnswerError

if TYPE_CHECKING:
    from frobs_devkit.doctor import RobotReport
    from frobs_devkit.testing import Report

_CLEARANCE = 0.05  # [m], minimum height of the joints and the tool above the floor in the home position
_POSTURES = 2048
_FATAL = ("model_has_joints", "tcp_moves")
_SIMULATOR = "mujoco"
_LICENSES = ("LICEN[CS]E*", "COPYING*", "COPYRIGHT*")
_NAMED = {".obj": re.compile(r"^mtllib (.*)$", re.MULTILINE), ".gltf": re.compile(r'"uri"\s*:\s*"([^"]*)"')}
"""Expressions for the names of the files that a mesh refers to, by suffix of the mesh."""
_LICENSE_FOLDERS = 5  # maximum number of folders to search, starting with the model file's own folder


@dataclass(frozen=True, kw_only=True)
class RobotFacts:
    """Data derived from a robot's model file.

    Attributes:
        model: The parsed model file.
        model_name: Name of the model file in the plugin.
        summary: One-line summary for lists of robots.
        tcp: Link of the tool center point.
        home: Home position [rad or m] by joint name. Empty if the model's default home position is used.
        robot: Description of the robot, with the gripper that was found in the model file, if any.
        joints: One line of text for each actuated joint.
        expected_failures: Reasons for the expected failures of conformance checks, by check name.
        report: Markdown text with the doctor's warnings and the location of the model file's license.
        license: License text of the model file and its meshes, or a placeholder text if no license file was found.
    """

    model: RobotModel
    model_name: str
    summary: str
    tcp: str
    home: Mapping[str, float]
    robot: Robot
    joints: tuple[str, ...]
    expected_failures: Mapping[str, str]
    report: str
    license: str


def facts_for(context: Mapping[str, Any]) -> RobotFacts:
    """Derive the data for a robot's description from the model file that the answers specify.

    If cookiecutter asked the questions, a relative path is relative to cookiecutter's output folder.
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
    """Derive the data for a robot's description from its model file.

    The arguments are answers to the questions: without a ``tcp``, the most likely link is chosen, ``xacro_args`` are
    such as ``"a:=1 b:=2"``, and ``package_paths`` are separated like the entries of ``PATH``. Failing conformance
    checks raise an AnswerError, unless ``failing_checks`` is ``"expect"``. Errors of the doctor and essential checks
    always do.
    """
    from frobs_cli import model_options
    from frobs_devkit.doctor import Severity, examine_robot

    args = model_options.xacro_args([xacro_args])
    paths = model_options.package_paths([part for part in package_paths.split(os.pathsep) if part])
    facts = examine_robot(robot_file, xacro_args=args, package_paths=paths)
    for finding in facts.findings:
        if finding.severity is Severity.ERROR:
            raise AnswerError(f"{robot_file}: {finding.about}: {finding.problem}; {finding.advice}.")
    described = _describe_gripper(
        Robot(
            model=robot_file,
            name=name,
            tcp=tcp or None,
            xacro_args=args,
            package_paths={key: str(folder) for key, folder in paths.items()},
        ),
        facts,
    )
    model = described.read_model()
    links = [link.name for link in model.links]
    if tcp and tcp not in links:
        raise UnknownNameError(f"link of '{model.name}'", tcp, links)
    tool = described.tcp or default_tcp(model)
    home = {**described.home, **(_home(model, tool) if model.joint_names else {})}
    model_name = f"{name}.xml" if model.format == "mjcf" else f"{name}.urdf"
    with tempfile.TemporaryDirectory() as folder:
        copy_model(model, Path(folder) / model_name)
        local: dict[str, Any] = {"model": str(Path(folder) / model_name), "xacro_args": {}, "package_paths": {}}
        checks = _check(replace(described, name=name, home=home, tcp=tool, **local))
    failures = {result.name: result.message for result in checks.failed}
    is_fatal = not failures.keys().isdisjoint(_FATAL)
    if is_fatal or (failures and failing_checks == "reject"):
        reasons = " ".join(f"{check}: {' '.join(message.split())}" for check, message in failures.items())
        way_out = "" if is_fatal else ", or accept the failures with --failing-checks expect"
        raise AnswerError(
            f"{robot_file}: the robot fails conformance checks. {reasons} Follow the advice of "
            f"'frobs doctor robot' to fix the file{way_out}."
        )
    warnings = [f"- {f.about}: {f.problem}; {f.advice}" for f in facts.findings if f.severity is Severity.WARNING]
    report = f"Taken from `{Path(robot_file).name}`: {facts.dof} joints, {facts.mass:.3g} kg, tool `{tool}`."
    if facts.gripper is not None:
        report += (
            f" FRobs found the gripper, replaced the collision shapes of its fingers by convex parts, and added the link "
            f"`{tool}` between its pads."
        )
    if warnings:
        report += " Findings of `frobs doctor robot`:\n\n" + "\n".join(warnings)
    source, license = find_license(Path(robot_file))
    report += f"\n\nThe license of this package does not cover the model file and its meshes. {source}\n"
    return RobotFacts(
        model=model,
        model_name=model_name,
        summary=f"{facts.dof} joints, from {Path(robot_file).name}".replace('"', "'").replace("\\", "/"),
        tcp=tool,
        home=home,
        robot=described,
        joints=tuple(map(_describe, model.actuated_joints)),
        expected_failures={name: _shortened(message) for name, message in failures.items()},
        report=report,
        license=license,
    )


def _describe_gripper(robot: Robot, facts: RobotReport) -> Robot:
    """Return a robot with the gripper that the doctor found. Joints, gains and sizes are rounded for the source code."""
    if facts.gripper is None or facts.file_format != "urdf":
        return robot
    found: Robot = find_reader(robot.model).with_gripper(robot, facts.gripper.statement())
    assert found.gains is not None
    gains = {
        name: {joint: float(f"{value:.6g}") for joint, value in getattr(found.gains, name).items()}
        for name in ("stiffness", "damping")
    }
    return replace(found, gains=DriveGains(**gains), armature={k: float(f"{v:.6g}") for k, v in found.armature.items()})


def find_license(file: Path) -> tuple[str, str]:
    """Return a sentence about the location of a model file's license, and the license text.

    The search starts in the file's folder and continues through four parent folders, up to the repository's root.
    """
    declared = ""
    for folder in list(file.resolve().parents)[:_LICENSE_FOLDERS]:
        files = sorted(path for pattern in _LICENSES for path in folder.glob(pattern) if path.is_file())
        if files:
            source = f"The license of the model and its meshes is in `MODEL_LICENSE`, a copy of `{files[0].name}`."
            return source, files[0].read_text("utf-8", errors="replace")
        manifest = folder / "package.xml"
        if not declared and manifest.is_file():
            licenses = re.findall(r"<license\b[^>]*>([^<]*)</license>", manifest.read_text("utf-8", "replace"))
            declared = ", ".join(licenses)
        if (folder / ".git").exists():
            break
    if declared:
        return (
            f"The ROS package declares the license {declared}. Put the text of that license into `MODEL_LICENSE`.",
            f"The ROS package of the model declares the license {declared}. Replace this file with the text of that "
            "license.\n",
        )
    return (
        "**No license was found**: ask the authors for their license, and put it into `MODEL_LICENSE` before you "
        "distribute the package.",
        "No license was found for the model file. Ask the authors of the model and its meshes for their license, and "
        "replace\nthis file with its text before you distribute the package.\n",
    )


def copy_model(model: RobotModel, file: Path) -> None:
    """Write a robot's model file with expanded macros, and copy its meshes and textures.

    Args:
        model: The parsed model.
        file: The model file to write. Meshes and textures are copied to the ``meshes`` folder next to the model file.
    """
    root = ElementTree.fromstring(model.xml)
    taken: dict[Path, str] = {}
    for element in root.iter():
        for attribute, value in element.attrib.items():
            source = Path(value.removeprefix("file://"))
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
    """Copy a file, and the files beside it that a mesh names, and return its new path in the folder.

    Files of one name from different folders do not replace each other, because each of these has a subfolder.
    """
    place = folder / taken.setdefault(source.parent, str(len(taken) + 1) if taken else "")
    named = _NAMED.get(source.suffix.lower())
    names = named.findall(source.read_text(errors="replace")) if named else []
    for name in (source.name, *map(str.strip, names)):
        file = source.parent / name
        if file.is_file() and file.resolve().is_relative_to(source.parent.resolve()):
            target = place / os.path.relpath(file, source.parent)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, target)
    return (place / source.name).relative_to(folder).as_posix()


def _check(robot: Robot) -> Report:
    from frobs_core import plugins
    from frobs_devkit.testing import check_robot, run_checks

    simulators = [_SIMULATOR] if _SIMULATOR in plugins.records("simulator") else []
    return run_checks(check_robot(robot, simulators=simulators))


def _home(model: RobotModel, tool: str) -> dict[str, float]:
    """Return a home position that is clear of the floor, or an empty dictionary to use the default home position.

    The dictionary is empty if the default position is clear of the floor, or if no sampled position is clear.
    Otherwise, the result is a clear sample that is likely to be near the default position.
    """
    default = home_positions(model, {})
    if _height(model, tool, default[None])[0] > _CLEARANCE:
        return {}
    limits = np.array([(joint.limits.lower, joint.limits.upper) for joint in model.actuated_joints])
    low, high = limits.clip(-math.pi, math.pi).T
    postures = RandomSource(1).uniform("home", low, high, (_POSTURES, len(low)))[0]
    # Scale the samples so that later samples tend to be farther from the default position.
    postures = default + np.linspace(0.0, 1.0, _POSTURES)[:, None] * (postures - default)
    postures = np.clip(np.round(postures, 2), np.ceil(low * 100) / 100, np.floor(high * 100) / 100)
    clear = _height(model, tool, postures) > _CLEARANCE
    if not clear.any():
        return {}
    chosen = postures[int(clear.argmax())].tolist()
    return dict(zip(model.joint_names, chosen, strict=True))


def _height(model: RobotModel, tool: str, postures: Floats) -> Floats:
    """Return the height of the lowest point among the tool and all joints except the first, (k,) [m]."""
    frames = [joint.child for joint in model.actuated_joints[1:]] + [tool]
    return np.asarray(np.min([model.frame_pose(frame, postures)[0][:, 2] for frame in frames], axis=0))


def _describe(joint: Joint) -> str:
    lower, upper = joint.limits.lower, joint.limits.upper
    bounded = math.isfinite(lower) or math.isfinite(upper)
    return f"``{joint.name}``: {joint.type.value}, {f'{lower:g} to {upper:g}' if bounded else 'without limits'}"


def _shortened(message: str) -> str:
    line = " ".join(message.split())
    return line if len(line) <= 80 else f"{line[:79]}…"

"""Reads a robot's file leniently, to find all problems at once instead of stopping at the first problem."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from frobs_core.models import RobotModel
from frobs_core.util.errors import ModelFileError
from frobs_devkit.doctor.robot_report import Difference, Finding, Severity
from frobs_models import Element, Packages, open_document, read_document

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_LOST_PACKAGE = re.compile(r"the ROS package '([^']*)' is not found")
_TOLERANCE = 1e-6  # maximum relative difference between numbers that are considered equal


@dataclass
class Reading:
    """A model, together with the findings and differences that were detected while its file was read."""

    model: RobotModel
    findings: list[Finding] = field(default_factory=list)
    differences: list[Difference] = field(default_factory=list)


def read(path: str | Path, xacro_args: Mapping[str, str], package_paths: Mapping[str, str | Path]) -> Reading:
    """Read a file leniently.

    Shapes with missing meshes and inertials with negative masses are removed and reported as findings.
    """
    root, file, packages = open_document(path, xacro_args=xacro_args, package_paths=package_paths)
    findings: list[Finding] = []
    numbers: dict[tuple[str, str], object] = {}
    if root.tag == "robot":
        findings += _unresolved_meshes(root, packages)
        findings += _negative_masses(root)
        numbers = _numbers_of_file(root)  # must precede read_document, which repairs values in place
    model = read_document(root, file, packages)
    return Reading(model, findings, _differences(numbers, model))


def _unresolved_meshes(root: Element, packages: Packages) -> list[Finding]:
    lost: dict[str, list[tuple[str, int | None]]] = {}
    needed = set()  # reasons for which a simulator does not build the robot; it does without the mesh of a visual
    for link in root.children("link"):
        for shape in list(link.children("visual", "collision")):
            for mesh in shape.descendants("mesh"):
                uri = mesh.get("filename", "")
                try:
                    packages.resolve(uri, packages.file.parent)
                except ModelFileError as error:
                    if uri:
                        lost.setdefault(error.reason, []).append((uri, mesh.line))
                        if shape.tag == "collision" or not packages.missing(uri, packages.file.parent):
                            needed.add(error.reason)
                        link.remove(shape)
                        break
    return [_missing(reason, places, reason in needed) for reason, places in lost.items()]


def _missing(reason: str, places: list[tuple[str, int | None]], is_needed: bool) -> Finding:
    uri, line = places[0]
    shapes = "1 shape" if len(places) == 1 else f"{len(places)} shapes"
    match = _LOST_PACKAGE.search(reason)
    if match:
        about = f"package '{match[1]}'"
        problem = f"the ROS package was not found; it contains the meshes of {shapes}, such as '{uri}'"
        advice = f"set the package's location with --package-path {match[1]}=FOLDER or ROS_PACKAGE_PATH"
    else:
        about = f"mesh '{uri}'"
        are = "is" if len(places) == 1 else "are"
        problem = f"{reason.rstrip('.')}; {shapes} of the robot {are} defined by this mesh"
        advice = "add the missing mesh file, or correct its path in the robot file"
    severity = Severity.ERROR if is_needed else Severity.WARNING
    return Finding("unresolved-mesh", severity, about, problem, advice, line)


def _negative_masses(root: Element) -> list[Finding]:
    """Remove the inertials of links with negative masses, and return one finding per link."""
    findings = []
    for link in root.children("link"):
        inertial = link.child("inertial")
        mass = None if inertial is None else inertial.child("mass")
        if inertial is None or mass is None or mass.number("value") >= 0.0:
            continue
        link.remove(inertial)
        about, problem = f"link '{link.get('name')}'", f"the link's mass is {mass.number('value'):g} kg"
        advice = "set a positive mass; a link that is only a frame needs no <inertial>"
        findings.append(Finding("negative-mass", Severity.ERROR, about, problem, advice, inertial.line))
    return findings


def _numbers_of_file(root: Element) -> dict[tuple[str, str], object]:
    """Return the link and joint values that ``read_document`` may change, keyed by (element, quantity)."""
    numbers: dict[tuple[str, str], object] = {}
    for link in root.children("link"):
        about = f"link '{link.get('name')}'"
        inertial = link.child("inertial")
        mass = None if inertial is None else inertial.child("mass")
        inertia = None if inertial is None else inertial.child("inertia")
        numbers[about, "mass"] = None if mass is None else mass.number("value")
        numbers[about, "inertia"] = None if inertia is None else [inertia.number(key, "0") for key in _MOMENTS]
    for joint in root.children("joint"):
        about, limit = f"joint '{joint.get('name')}'", joint.child("limit")
        numbers[about, "type"] = joint.get("type")
        if limit is not None and joint.get("type") in ("revolute", "continuous", "prismatic"):
            for attribute in ("lower", "upper", "velocity", "effort"):
                value = limit.cap(attribute) if attribute in limit.attrib else math.inf
                numbers[about, f"{attribute} limit"] = value if math.isfinite(value) else None
    return numbers


def _differences(numbers: Mapping[tuple[str, str], object], model: RobotModel) -> list[Difference]:
    used: dict[tuple[str, str], object] = {}
    for link in model.links:
        about, inertial = f"link '{link.name}'", link.inertial
        used[about, "mass"] = None if inertial is None else inertial.mass
        used[about, "inertia"] = None if inertial is None else list(inertial.inertia)
    for joint in model.joints:
        about, limits = f"joint '{joint.name}'", joint.limits
        used[about, "type"] = joint.type.value
        for attribute in ("lower", "upper", "velocity", "effort"):
            value = getattr(limits, attribute)
            used[about, f"{attribute} limit"] = value if np.isfinite(value) else None
    return [
        Difference(about, quantity, said, used.get((about, quantity)))
        for (about, quantity), said in numbers.items()
        if not _same(said, used.get((about, quantity)))
    ]


def _same(said: object, used: object) -> bool:
    if said is None or used is None or isinstance(said, str):
        return said == used
    return bool(np.allclose(np.asarray(said, float), np.asarray(used, float), rtol=_TOLERANCE, atol=1e-12))

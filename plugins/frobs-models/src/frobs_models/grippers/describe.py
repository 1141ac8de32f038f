"""Describes the gripper of a model file, so that tasks and controllers can use it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from frobs_core.description import DriveGains, EndEffector, Robot
from frobs_core.models import (
    Inertial,
    JointType,
    Pose,
    RobotModel,
    default_gains,
    gravity_efforts,
    home_positions,
    joint_path,
    load_model,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import UnsuitableRobotError, check_name
from frobs_core.util.rotations import matrix_from_quat, rpy_from_quat
from frobs_models.assembled import write_model, write_part
from frobs_models.bounds import lowest_points, random_postures
from frobs_models.grippers.gripper import Gripper, find_gripper, find_grippers
from frobs_models.grippers.loops import without_loops
from frobs_models.grippers.space import wrist_camera
from frobs_models.grippers.structure import Tree
from frobs_models.grippers.surfaces import placed_surface, solid_shapes
from frobs_models.meshes.mesh import MeshPart
from frobs_models.tree import UNKNOWN_MASS, check_masses
from frobs_models.urdf.writing import urdf_of

TCP = "frobs_tcp"
"""Name of the link that is added as the tool center point."""

_STIFFNESS, _DAMPING, _INERTIA = 10_000.0, 300.0, 1.0
"""Gains [N/m, N·s/m] and motor inertia [kg] at each pad, as those of ``frobs_grippers.PARALLEL_GRIPPER``."""

_FORCE = 40.0  # [N] maximum force of each pad
_CLOSING_TIME = 0.3  # [s] in which a gripper whose velocity limit is not plausible closes
_SLAB, _MOST_SLABS = 0.01, 14  # [m] thickness and number of the convex slabs that replace the mesh of a finger
_FLAT = 1e-6  # [m] thickness below which a slab has no volume
_FRICTION = 1.2
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_LOAD = 0.1  # [kg] mass of a cube of 40 mm
_SAG = 0.045  # [rad or m] by which gravity bends a joint at most, in random postures
_POSTURES = 128  # number of random postures
_STRONG = 0.8  # fraction of the effort limits that may hold the home position
_CLEARANCE, _TOUCH = 0.02, -1e-3  # [m] height of a home position that replaces one in the floor, and lowest height


def describe_gripper(robot: Robot, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a robot's gripper. For arguments and errors, see ``ModelReader.describe_gripper``."""
    return _find(robot, robot.read_model(), stated).statement()


def with_gripper(robot: Robot, stated: Mapping[str, Any] | None = None) -> Robot:
    """Return a robot whose gripper is described. For arguments and errors, see ``ModelReader.with_gripper``."""
    model = without_loops(robot.read_model())
    check_masses(model, UNKNOWN_MASS)
    gripper = _find(robot, model, stated or {})
    _check_tool(robot, model, gripper)
    file = write_model(model.name, _rewritten(model, gripper))
    groups = {"arm": gripper.arm, "gripper": gripper.joints}
    tool = EndEffector(
        tcp=robot.tcp or TCP,
        arm="arm",
        group="gripper",
        open=gripper.open,
        closed=gripper.closed,
        gap=gripper.gap,
        has_fixed_jaw=gripper.has_one_jaw,
    )
    rewritten = load_model(file)
    motors = _motors(model, dict(_least_inertias(rewritten, gripper)))
    driven = replace(
        rewritten, joints=tuple(replace(each, armature=motors.get(each.name, 0.0)) for each in rewritten.joints)
    )
    usual = _home(rewritten, gripper)
    home = {**(usual if set(gripper.arm).isdisjoint(robot.home) else gripper.open), **robot.home}
    gains = robot.gains or _stiffened(driven, home_positions(driven, usual))  # the same for any start posture
    squares = {name: lever * lever for name, lever in gripper.levers.items()}
    return replace(
        robot,
        model=str(file),
        xacro_args={},
        package_paths={},
        home=home,
        tcp=robot.tcp or TCP,
        gains=DriveGains(
            stiffness=_gains(rewritten, gains, squares, 0, _STIFFNESS),
            damping=_gains(rewritten, gains, squares, 1, _DAMPING),
        ),
        self_collision=False,  # the convex parts of coupled fingers overlap while they move
        friction={**dict.fromkeys(gripper.pads, _FRICTION), **robot.friction},
        armature={**motors, **dict(_armature(rewritten, squares)), **robot.armature},
        groups=groups,
        default_controllers={"gripper": gripper.controller, **robot.default_controllers},
        end_effectors={"gripper": tool},
        cameras={"wrist": wrist_camera(rewritten, tool, home), **robot.cameras},
    )


def _find(robot: Robot, model: RobotModel, stated: Mapping[str, Any]) -> Gripper:
    """Return the gripper of a robot, or raise an error that tells how to attach one."""
    try:
        return find_gripper(model, stated)
    except UnsuitableRobotError as error:
        tree, others = Tree(model), [] if stated.get("joints") or robot.tcp is None else find_grippers(model)
        carrying = [each for each in others if robot.tcp in (*tree.links(each.palm), *each.pads)]
        if len(carrying) == 1:
            return carrying[0]
        if "--gripper" in error.reason:
            raise UnsuitableRobotError(robot.name, error.reason) from None
        advice = "To attach one, pass its name or its file: attach='GRIPPER' (option --attach), or use Robot.attach."
        raise UnsuitableRobotError(robot.name, f"{error.reason} {advice}") from None


def _check_tool(robot: Robot, model: RobotModel, gripper: Gripper) -> None:
    """Check that drives of the arm move the tool center point."""
    if not gripper.arm:
        reason = f"has no actuator for a joint between its root and '{gripper.palm}', so it cannot move its gripper"
        raise UnsuitableRobotError(robot.name, f"{reason}; add actuators for these joints to the model file.")
    if robot.tcp is None:
        return
    check_name(f"link of '{model.name}'", robot.tcp, [link.name for link in model.links])
    if {joint.name for joint in joint_path(model, robot.tcp)}.isdisjoint(gripper.arm):
        raise UnsuitableRobotError(
            robot.name,
            f"has no joint that moves the tool center point '{robot.tcp}'; choose a link of the gripper, such as "
            f"tcp='{gripper.palm}' (option --tcp), or omit tcp.",
        )


def _gains(
    model: RobotModel, gains: DriveGains, squares: Mapping[str, float], part: int, at_pad: float
) -> dict[str, float]:
    """Return one of the gains of each joint. The drives of the fingers have a given gain at the pads."""
    return {name: at_pad * squares[name] if name in squares else gains.of(name)[part] for name in model.joint_names}


def _stiffened(model: RobotModel, home: Floats) -> DriveGains:
    """Return default gains, increased so that gravity bends no joint noticeably, unless its effort limit is too low.

    Default gains are proportional to the inertia, so a wrist with a heavy hand close to its axis would bend.
    """
    postures = [home, *random_postures(model, _POSTURES)]
    weights = np.abs([gravity_efforts(model, posture) for posture in postures]).max(axis=0)
    gains, stiffness, damping = default_gains(model, home), {}, {}
    for joint, weight in zip(model.actuated_joints, weights.tolist(), strict=True):
        kp, kd = gains.of(joint.name)
        stiffness[joint.name] = max(kp, min(weight, joint.limits.effort) / _SAG)
        damping[joint.name] = kd * (stiffness[joint.name] / kp) ** 0.5  # the damping ratio stays the same
    return DriveGains(stiffness=stiffness, damping=damping)


def _home(model: RobotModel, gripper: Gripper) -> dict[str, float]:
    """Return the home position with an open gripper. If it is in the floor, raise the arm.

    Many arms are folded where all joints are 0, so a gripper reaches below the floor on which the arm stands.
    """
    home = dict(gripper.open)
    posture = home_positions(model, home)
    moved = {
        link.name
        for link in model.links
        if not {joint.name for joint in joint_path(model, link.name)}.isdisjoint(gripper.arm)
    }
    below = [link for link, height in lowest_points(model, posture, _UPRIGHT).items() if height < _TOUCH]
    if moved.isdisjoint(below):
        return home
    columns = [model.joint_names.index(name) for name in gripper.arm]
    postures = np.tile(posture, (_POSTURES, 1))  # those nearest to the original one first
    away = random_postures(model, _POSTURES)[:, columns] - posture[columns]
    postures[:, columns] += np.linspace(0.0, 1.0, _POSTURES)[:, None] * away
    lowest = [lowest_points(model, each, _UPRIGHT) for each in postures]
    lifted = [name for name in moved & set(lowest[0]) if max(each[name] for each in lowest) > _CLEARANCE]
    if set(lifted).isdisjoint(below):
        return home
    clear = (min(each[name] for name in lifted) > _CLEARANCE for each in lowest)
    held = (each for each, is_clear in zip(postures, clear, strict=True) if is_clear and _holds(model, each))
    posture = next(held, posture)
    return home | {name: float(posture[column]) for name, column in zip(gripper.arm, columns, strict=True)}


def _holds(model: RobotModel, posture: Floats) -> bool:
    """Return whether the drives can hold a posture (dof,) [rad or m] against gravity."""
    limits = np.array([joint.limits.effort for joint in model.actuated_joints])
    return bool((np.abs(gravity_efforts(model, posture)) <= _STRONG * limits).all())


def _motors(model: RobotModel, least: Mapping[str, float]) -> dict[str, float]:
    """Return the inertia of the motors in the file, which a URDF cannot contain, or what the joints need instead."""
    found = {name: joint.armature for name, joint in zip(model.joint_names, model.actuated_joints, strict=True)}
    return {name: value for name in found if (value := max(found[name], least.get(name, 0.0)))}


def _least_inertias(model: RobotModel, gripper: Gripper) -> Iterator[tuple[str, float]]:
    """Yield the inertia that arm joints lack to carry an object: files without masses have links of a gram."""
    load = Inertial(_LOAD * (gripper.object_size / 0.04) ** 3, Pose(), (0.0,) * 6)
    links = tuple(replace(link, inertial=load if link.name == TCP else None) for link in model.links)
    moved, needed = (_largest_inertias(each, gripper) for each in (model, replace(model, links=links)))
    for name, joint in zip(model.joint_names, model.actuated_joints, strict=True):
        if name in gripper.arm and joint.type is not JointType.PRISMATIC and needed[name] > moved[name]:
            yield name, needed[name]


def _largest_inertias(model: RobotModel, gripper: Gripper) -> dict[str, float]:
    """Return the largest inertia that each joint moves in any posture, by inverting the formula of the gains."""
    gains = default_gains(model, home_positions(model, gripper.open))
    return {name: gains.of(name)[1] ** 2 / (4.0 * gains.of(name)[0]) for name in model.joint_names}


def _armature(model: RobotModel, squares: Mapping[str, float]) -> Iterator[tuple[str, float]]:
    """Yield the inertia of the motor of each finger joint, and half of it for joints that follow."""
    for joint in model.joints:
        leader = model.leader(joint)
        if leader is not None and leader.joint in squares:
            share = 1.0 if joint.name == leader.joint else 0.5
            yield joint.name, share * _INERTIA * squares[leader.joint]


def _rewritten(model: RobotModel, gripper: Gripper) -> str:
    """Return the text of the URDF with the tool center point, convex fingers and plausible limits of their drives."""
    root = ET.fromstring(model.xml) if model.format == "urdf" else urdf_of(model)
    for old in [*root.findall("link"), *root.findall("joint")]:  # of a file that was already rewritten
        child = old.find("child")
        if TCP in (old.get("name"), None if child is None else child.get("link")):
            root.remove(old)
    elements = {element.get("name"): element for element in root.findall("link")}
    ET.SubElement(root, "link", {"name": TCP})
    mount = ET.SubElement(root, "joint", {"name": f"{TCP}_mount", "type": "fixed"})
    ET.SubElement(mount, "parent", {"link": gripper.palm})
    ET.SubElement(mount, "child", {"link": TCP})
    ET.SubElement(mount, "origin", _origin(gripper.tcp.pos, rpy_from_quat(gripper.tcp.quat_wxyz)))
    for link, parts in _slabs(model, gripper):
        element = elements[link]
        for old in element.findall("collision"):
            element.remove(old)
        for part in parts:
            geometry = ET.SubElement(ET.SubElement(element, "collision"), "geometry")
            ET.SubElement(geometry, "mesh", {"filename": str(part)})
    for joint in root.findall("joint"):
        name, limit = joint.get("name", ""), joint.find("limit")
        if limit is not None and name in gripper.joints:
            _set_limits(limit, gripper, name)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _origin(pos: tuple[float, ...], rpy: tuple[float, ...]) -> dict[str, str]:
    return {"xyz": " ".join(map(repr, pos)), "rpy": " ".join(map(repr, rpy))}


def _set_limits(limit: ET.Element, gripper: Gripper, joint: str) -> None:
    """Set the effort for a usual force at the pads, and the velocity, unless it is plausible."""
    single = len(gripper.joints) == 1 and not gripper.has_one_jaw  # one drive moves both pads
    limit.set("effort", f"{_FORCE * gripper.levers[joint] * (2 if single else 1):.6g}")
    needed = abs(gripper.open[joint] - gripper.closed[joint]) / _CLOSING_TIME
    velocity = float(limit.get("velocity") or 0.0)
    if not 0.5 * needed <= velocity <= 3.0 * needed:
        limit.set("velocity", f"{needed:.6g}")


def _slabs(model: RobotModel, gripper: Gripper) -> Iterator[tuple[str, list[Path]]]:
    """Yield the links of the fingers, and files of the convex parts that replace their meshes.

    Each mesh is cut across the direction of approach, because the convex hull of a bent finger would fill the gap.
    """
    positions = home_positions(model, gripper.open)[None]
    approach = _turn(model, gripper.palm, positions) @ matrix_from_quat(np.array(gripper.tcp.quat_wxyz))[:, 2]
    links = {link.name: link for link in model.links}
    for name in dict.fromkeys(gripper.pads):
        direction = _turn(model, name, positions).T @ approach
        parts: list[Any] = []
        for shape in solid_shapes(links[name]):
            mesh = placed_surface(shape)
            parts += _cut(mesh, direction) if hasattr(shape.geometry, "path") else [mesh.convex_hull]
        if parts:
            yield (
                name,
                [
                    write_part(MeshPart(np.asarray(part.vertices, float), np.asarray(part.faces, np.int32)))
                    for part in parts
                ],
            )


def _turn(model: RobotModel, link: str, positions: Floats) -> Floats:
    return matrix_from_quat(model.frame_pose(link, positions)[1][0])


def _cut(mesh: Any, direction: Floats) -> list[Any]:
    """Return the convex hulls of slabs of a mesh, cut across a direction."""
    import trimesh

    vertices = np.asarray(mesh.vertices)
    heights = vertices @ direction
    low, high = float(heights.min()), float(heights.max())
    planes = np.linspace(low, high, int(np.clip((high - low) / _SLAB, 1, _MOST_SLABS)) + 1)
    cuts = [_on_plane(mesh, heights, plane) for plane in planes]
    hulls = []
    for index, (bottom, top) in enumerate(pairwise(planes)):
        inside = vertices[(heights >= bottom) & (heights <= top)]
        points = np.concatenate([inside, cuts[index], cuts[index + 1]])
        if len(points) > 3 and np.linalg.matrix_rank(points - points[0], tol=_FLAT) == 3:
            hulls.append(trimesh.convex.convex_hull(points))
    return hulls


def _on_plane(mesh: Any, heights: Floats, plane: float) -> Floats:
    """Return the points at which the edges of a mesh cross a plane, (n, 3) [m]."""
    edges = np.asarray(mesh.edges_unique)
    first, second = heights[edges[:, 0]] - plane, heights[edges[:, 1]] - plane
    crossing = first * second < 0.0
    share = (first[crossing] / (first[crossing] - second[crossing]))[:, None]
    start, end = (np.asarray(mesh.vertices)[edges[crossing, side]] for side in (0, 1))
    return np.asarray(start + share * (end - start))

"""Describes the limits and drives of joints, and the candidate links for the tool center point with their reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from frobs_core.models import (
    MOVING,
    TOOL_NAMES,
    Joint,
    JointType,
    RobotModel,
    default_gains,
    default_tcp,
    gravity_efforts,
    joint_path,
    longest_reach,
    usual_rank,
)
from frobs_core.util.arrays import Floats
from frobs_devkit.doctor.robot_report import DriveFacts, Finding, JointFacts, Severity, ToolCandidate, warning

_DEGREES = 4.0 * math.pi  # [rad] larger limits are probably in degrees, because joints rarely turn that far


def joint_facts(model: RobotModel, home: Floats) -> tuple[JointFacts, ...]:
    """Return the facts about every joint, given the home position (dof,) [rad or m]."""
    drives = _drives(model, home)
    rests = dict(zip(model.joint_names, home.tolist(), strict=True))
    return tuple(_facts(joint, rests, drives) for joint in model.joints)


def _facts(joint: Joint, rests: dict[str, float], drives: dict[str, DriveFacts]) -> JointFacts:
    moving, mimic, limits = joint.type in MOVING, joint.mimic, joint.limits
    home = rests.get(joint.name)
    if mimic is not None:
        home = mimic.multiplier * rests[mimic.joint] + mimic.offset
    return JointFacts(
        name=joint.name,
        joint_type=joint.type.value,
        parent=joint.parent,
        child=joint.child,
        unit=("m" if joint.type is JointType.PRISMATIC else "rad") if moving else "",
        axis=joint.axis,
        lower=_finite(limits.lower),
        upper=_finite(limits.upper),
        velocity=_finite(limits.velocity),
        effort=_finite(limits.effort),
        damping=joint.damping,
        friction=joint.friction,
        mimic=None if mimic is None else {"joint": mimic.joint, "multiplier": mimic.multiplier, "offset": mimic.offset},
        home=home,
        drive=drives.get(joint.name),
    )


def _drives(model: RobotModel, home: Floats) -> dict[str, DriveFacts]:
    gains, weights = default_gains(model, home), gravity_efforts(model, home)
    drives = {}
    for joint, weight in zip(model.joint_names, weights.tolist(), strict=True):
        stiffness, damping = gains.of(joint)
        omega = 2.0 * stiffness / damping  # critical damping: Kp = I·ω² and Kd = 2·I·ω
        drives[joint] = DriveFacts(
            inertia=damping / (2.0 * omega),
            stiffness=stiffness,
            damping=damping,
            bandwidth=omega / (2.0 * math.pi),
            time_constant=1.0 / omega,
            holding_effort=weight,
        )
    return drives


def joint_findings(model: RobotModel, facts: tuple[JointFacts, ...]) -> Iterator[Finding]:
    """Yield findings about the joints."""
    if not model.joint_names:
        problem = "the robot has no movable joint, so there is nothing to control"
        advice = "set the type of moving joints to revolute, continuous or prismatic"
        yield Finding("no-joints", Severity.ERROR, f"robot '{model.name}'", problem, advice)
    for joint in facts:
        span = max(abs(joint.lower or 0.0), abs(joint.upper or 0.0))
        about = f"joint '{joint.name}'"
        if joint.joint_type == "revolute" and joint.mimic is None and span > _DEGREES:
            yield warning(
                "limits-in-degrees",
                about,
                f"the joint limits are {joint.lower:g} and {joint.upper:g} rad, up to {span / (2 * math.pi):.0f} turns "
                "from zero",
                "specify the limits in radians; if the joint really turns that far, make it continuous",
            )
        drive = joint.drive
        if drive and joint.effort is not None and abs(drive.holding_effort) > joint.effort:
            unit = "N" if joint.unit == "m" else "N·m"
            yield warning(
                "too-weak",
                about,
                f"the joint's effort limit of {joint.effort:.3g} is too low: holding the home position requires "
                f"{abs(drive.holding_effort):.3g} {unit}",
                "check the effort limit and the masses that the joint carries, or choose a home position with a lower "
                "load",
            )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


_SAMPLES = 2000
_TURN = math.pi  # [rad] range in both directions for a joint without limits
_SLIDE = 1.0  # [m] range in both directions for a prismatic joint without limits


def tool_candidates(model: RobotModel, tcp: str | None = None) -> tuple[ToolCandidate, ...]:
    """Return the links at the ends of kinematic chains and the links with common tool names, most likely first.

    The ``tcp`` is declared in the robot's description, or None.
    """
    parents = {joint.parent for joint in model.joints}
    moving, chosen, drawn = set(model.joint_names), tcp or default_tcp(model), _random_positions(model)
    ranked = []
    for link in model.links:
        usual = usual_rank(link.name)
        if link.name in parents and not usual and link.name != chosen:
            continue
        path = joint_path(model, link.name)
        actuated = sum(joint.name in moving for joint in path)
        bound = longest_reach(model, link.name)
        candidate = ToolCandidate(
            link=link.name,
            actuated_joints=actuated,
            usual_name=usual > 0,
            reach=float(np.linalg.norm(model.frame_pose(link.name, drawn)[0], axis=1).max()),
            longest_reach=bound if math.isfinite(bound) else None,
            chosen=link.name == chosen,
        )
        ranked.append(((candidate.chosen, actuated, usual, len(path)), candidate))
    ranked.sort(key=lambda pair: pair[0], reverse=True)  # a stable sort: equally likely links keep the file's order
    return tuple(candidate for _, candidate in ranked)


def tool_findings(model: RobotModel, tools: tuple[ToolCandidate, ...]) -> Iterator[Finding]:
    """Yield a finding if the tool link was guessed."""
    if not tools[0].actuated_joints or tools[0].usual_name:
        return
    others = [f"'{tool.link}'" for tool in tools[1:] if tool.actuated_joints]
    if others:
        more = f" and {len(others) - 3} more" if len(others) > 3 else ""
        yield Finding(
            "which-tool",
            Severity.NOTE,
            f"link '{tools[0].link}'",
            "the link is used as the tool because it is moved by the most joints; other candidates are "
            f"{', '.join(others[:3])}{more}",
            f"choose the tool with tcp=LINK; links with names such as {', '.join(TOOL_NAMES[:3])} are recognized "
            "automatically",
        )


def _random_positions(model: RobotModel) -> Floats:
    """Return random joint positions (n, dof) within the limits, including the limits themselves."""
    low, high = [], []
    for joint in model.actuated_joints:
        far = _SLIDE if joint.type.value == "prismatic" else _TURN
        low.append(joint.limits.lower if math.isfinite(joint.limits.lower) else -far)
        high.append(joint.limits.upper if math.isfinite(joint.limits.upper) else far)
    samples = _SAMPLES if low else 1
    share = np.random.default_rng(0).uniform(-0.1, 1.1, (samples, len(low))).clip(0.0, 1.0)
    drawn: Floats = np.array(low) + share * (np.array(high) - np.array(low))
    return drawn

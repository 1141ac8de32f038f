"""Describes the limits and drives of joints."""

from __future__ import annotations

import math
from collections.abc import Iterator

from frobs_core.models import MOVING, Joint, JointType, RobotModel, default_gains, gravity_efforts
from frobs_core.util.arrays import Floats
from frobs_devkit.doctor.robot_report import DriveFacts, Finding, JointFacts, Severity, warning

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

"""Checks of a robot's model file and its description."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from frobs_core.interfaces import Robot
from frobs_core.models import JointType, default_tcp, home_positions, inertia_matrix, joint_path, load_model, usual_rank
from frobs_core.rotations import quat_rotate
from frobs_devkit.doctor.joints import joint_facts, joint_findings
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.robot.subject import RobotUnderTest
from frobs_devkit.testing.simulator.robots import ARM, model_of


def model_has_joints(subject: RobotUnderTest) -> None:
    """The model file can be read, and it has at least one actuated joint."""
    expect(isinstance(subject.robot, Robot), f"the entry point is {subject.robot!r}, no Robot.")
    expect(subject.model.joint_names, f"{subject.model.path} has no revolute, continuous or prismatic joint.")


def limits_are_stated(subject: RobotUnderTest) -> None:
    """Every joint that is not continuous has finite position limits; velocity and effort limits are positive."""
    missing = []
    for joint in subject.model.actuated_joints:
        limits = joint.limits
        if joint.type is not JointType.CONTINUOUS:
            expect(
                np.isfinite([limits.lower, limits.upper]).all() and limits.lower < limits.upper,
                f"joint '{joint.name}' has position limits [{limits.lower}, {limits.upper}]; state lower < upper.",
            )
        for name, limit in (("velocity", limits.velocity), ("effort", limits.effort)):
            expect(limit > 0, f"joint '{joint.name}' has a {name} limit of {limit}; it must be positive.")
            if np.isinf(limit):
                missing.append(f"{name} of '{joint.name}'")
    if missing:
        raise Inconclusive(f"the model states no limit for {', '.join(missing)}")


def limits_are_in_radians(subject: RobotUnderTest) -> None:
    """No joint turns so far that its limits must be in degrees; 'frobs doctor robot' says more about the numbers."""
    facts = joint_facts(subject.model, home_positions(subject.model, {}))
    odd = [one for one in joint_findings(subject.model, facts) if one.code == "limits-in-degrees"]
    expect(not odd, "; ".join(f"{one.about}: {one.problem}; {one.advice}" for one in odd) + ".")


def home_is_inside_limits(subject: RobotUnderTest) -> None:
    """Home names actuated joints, and each rests inside its limits."""
    home_positions(subject.model, subject.robot.home)


def tcp_moves(subject: RobotUnderTest) -> None:
    """The tool centre point is a link, and the joints move it (a wheeled robot's wheels do not)."""
    model = subject.model
    tcp = subject.robot.tcp or default_tcp(model)
    names = [link.name for link in model.links]
    expect(tcp in names, f"tcp '{tcp}' is no link; there are {', '.join(names)}.")
    if subject.robot.base == "wheeled":
        return
    home = home_positions(model, subject.robot.home)
    poses = np.concatenate(model.frame_pose(tcp, np.stack([home, home + 0.1])), axis=1)
    expect(np.abs(poses[0] - poses[1]).max() > 1e-6, f"no joint moves the tcp '{tcp}'; name a link at the chain's end.")
    fixed = {joint.name for joint in joint_path(model, tcp)}
    for name in names:
        beyond = [
            joint.name
            for joint in joint_path(model, name)
            if joint.name in model.joint_names and joint.name not in fixed
        ]
        on_chain = tcp in [joint.parent for joint in joint_path(model, name)]
        expect(
            not on_chain
            or (len(beyond) < 2 and not (beyond and usual_rank(name))),  # one more joint may be a gripper's
            f"joints {', '.join(beyond)} move the link '{name}' and not the tcp '{tcp}', which carries them; name a link "
            "at the chain's end.",
        )


def inertias_are_possible(subject: RobotUnderTest) -> None:
    """Masses are positive, and principal moments of inertia are positive and fulfil the triangle inequality."""
    for link in subject.model.links:
        if link.inertial is None:
            continue
        mass = link.inertial.mass
        expect(mass > 0, f"link '{link.name}' has a mass of {mass} kg; leave the inertial out or make it positive.")
        moments = np.linalg.eigvalsh(inertia_matrix(link.inertial))
        text = ", ".join(f"{moment:.3g}" for moment in moments)
        expect(moments[0] > 0, f"link '{link.name}' has principal moments {text} kg·m²; all must be positive.")
        expect(
            moments[0] + moments[1] >= moments[2] * (1 - 1e-6),
            f"link '{link.name}' has principal moments {text} kg·m²; no body has one larger than the other two together.",
        )


def notes_are_none(subject: RobotUnderTest) -> None:
    """Nothing of the model file had to be mended or left out when it was read."""
    notes = [str(note) for note in subject.model.notes if note.fault]
    expect(not notes, f"reading {subject.model.path.name}: {'; '.join(notes)}.")


def gains_are_positive(subject: RobotUnderTest) -> None:
    """Every joint is damped; every joint has stiffness, but for the wheels of a wheeled robot."""
    gains, model = subject.gains, subject.model
    for owner in (gains.stiffness, gains.damping):
        unknown = (
            [name for name in owner if name not in model.joint_names] if not isinstance(owner, float | int) else []
        )
        expect(not unknown, f"gains name {unknown}, which are no actuated joints: {', '.join(model.joint_names)}.")
    for name in model.joint_names:
        kp, kd = gains.of(name)
        expect(kd > 0, f"joint '{name}' has a damping gain of {kd}; it must be positive.")
        expect(kp >= 0, f"joint '{name}' has a stiffness of {kp}; it must not be negative.")
        expect(kp > 0 or subject.robot.base == "wheeled", f"joint '{name}' has no stiffness; it holds no position.")


def parts_exist(subject: RobotUnderTest) -> None:
    """Base, friction and differential drive are ones that there are, with possible numbers."""
    robot, model = subject.robot, subject.model
    expect(robot.base in ("fixed", "floating", "wheeled"), f"base is '{robot.base}', not fixed, floating or wheeled.")
    links = [link.name for link in model.links]
    for name, friction in robot.friction.items():
        expect(name in links, f"friction names '{name}', which is no link.")
        expect(0 <= friction < np.inf, f"the friction of '{name}' is {friction}; it must be finite and not negative.")
    drive = robot.differential_drive
    if drive is not None:
        unknown = [joint for joint in (*drive.left, *drive.right) if joint not in model.joint_names]
        expect(drive.left and drive.right and not unknown, f"differential_drive names {unknown or 'no wheel'}.")
        numbers = (drive.separation, drive.wheel_radius, drive.max_linear_velocity, drive.max_angular_velocity)
        accelerations = [a for a in (drive.max_linear_acceleration, drive.max_angular_acceleration) if a is not None]
        expect(min(*numbers, *accelerations) > 0, f"differential_drive has a number that is not positive: {drive}.")


def end_effectors_attach(subject: RobotUnderTest) -> None:
    """Attached to an arm, a tool keeps its masses, home, tool center point and open and closed positions."""
    tool, model = subject.robot, subject.model
    if not tool.end_effectors or tool.groups or model.format != "urdf":
        raise NotApplicable("the robot is no tool that can be attached")
    arm, at = replace(ARM, model=str(model_of(ARM.model).path)), (0.1, -0.2, 0.3)
    whole = arm.attach("tool", tool, name="kit", pos=at)
    joined = load_model(whole.model)
    effector, described = whole.end_effectors["kit"], next(iter(tool.end_effectors.values()))
    names = tuple(f"kit_{joint}" for joint in model.joint_names)
    expect(whole.groups.get("kit", ()) == names, f"the group of the tool is {whole.groups.get('kit')}, not {names}.")
    masses = [
        sum(link.inertial.mass for link in m.links if link.inertial) for m in (joined, model, model_of(ARM.model))
    ]
    expect_close(masses[1] + masses[2], masses[0], 1e-9, "mass of an arm with the tool [kg]")
    home = home_positions(joined, whole.home)
    own = home_positions(model, tool.home)
    places = [joined.joint_names.index(name) for name in names]
    expect_close(own, home[places], 1e-12, "home position of the attached tool")
    for state in ("open", "closed"):
        wanted = {f"kit_{joint}": value for joint, value in getattr(described, state).items()}
        found = getattr(effector, state)
        expect(found == wanted, f"the {state} positions of the attached tool are {found}, not {wanted}.")
    frames = {link: joined.frame_pose(link, home[None])[0][0] for link in ("tool", effector.tcp)}
    turn = joined.frame_pose("tool", home[None])[1]
    tip = quat_rotate(turn, (np.array(at) + model.frame_pose(described.tcp, own[None])[0][0])[None])[0]
    expect_close(frames["tool"] + tip, frames[effector.tcp], 1e-9, "tool center point of the attached tool [m]")

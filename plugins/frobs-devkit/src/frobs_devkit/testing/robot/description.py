"""Checks of a robot's model file and its description."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from frobs_core import plugins
from frobs_core.contracts import joint_groups
from frobs_core.description import Robot
from frobs_core.models import (
    JointType,
    RobotModel,
    composite_inertia,
    default_gains,
    default_tcp,
    gravity_efforts,
    home_positions,
    inertia_matrix,
    joint_path,
    load_model,
    usual_rank,
)
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_rotate
from frobs_devkit.doctor.bodies import body_findings, is_significant
from frobs_devkit.doctor.joints import joint_facts, joint_findings
from frobs_devkit.doctor.robot import note_advice
from frobs_devkit.doctor.robot_report import Finding, Severity
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.robot.under_test import RobotUnderTest
from frobs_devkit.testing.simulator.robots import ARM, model_of
from frobs_models import link_bounds, lowest_points, random_postures

_LIGHT = 0.02  # fraction of the robot's mass below which a link needs no collision shape
_FARTHEST = 20.0  # [m] maximum plausible position of a prismatic joint
_FASTEST = (50.0, "rad/s"), (20.0, "m/s")  # maximum plausible velocity limits of arms: of revolute, prismatic joints
_GYRATION = 1.0 / 45.0, 7.0  # range of plausible radii of gyration, as fractions of half a link's diagonal
_SOFTEST, _DAMPING = 0.1, (0.04, 25.0)  # minimum stiffness and range of damping, as fractions of the default gains
_SLOWEST = 0.5  # [s] maximum time constant Kd / Kp
_SLOWEST_OMEGA, _SAG, _POSTURES = 8.0, 0.1, 16  # [rad/s], [rad or m], number of postures in which joints carry weight
_RINGING = 0.2  # minimum damping ratio
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_STILL = 1e-4  # [m] change of a distance that is none
_NEAR = 0.01  # [m], maximum distance between the tcp's and the tool's origins
_BELOW, _LIFTS = -0.01, 64  # [m] tolerated height, and number of postures that may lift a link above the floor


def model_has_joints(subject: RobotUnderTest) -> None:
    """The model file can be read and has at least one actuated joint, unless the robot is a tool for an arm."""
    expect(isinstance(subject.robot, Robot), f"the robot's entry point is {subject.robot!r}; expected a Robot.")
    if not subject.model.joint_names and subject.robot.end_effectors:
        raise NotApplicable("the robot is a tool without joints")
    expect(subject.model.joint_names, f"{subject.model.path} has no revolute, continuous or prismatic joint.")


def limits_are_stated(subject: RobotUnderTest) -> None:
    """All non-continuous joints have finite position limits, and all velocity and effort limits are positive."""
    missing = []
    for joint in subject.model.actuated_joints:
        limits = joint.limits
        if joint.type is not JointType.CONTINUOUS:
            expect(
                np.isfinite([limits.lower, limits.upper]).all() and limits.lower < limits.upper,
                f"joint '{joint.name}' has position limits [{limits.lower}, {limits.upper}]; set lower < upper.",
            )
        for name, limit in (("velocity", limits.velocity), ("effort", limits.effort)):
            expect(limit > 0, f"joint '{joint.name}' has a {name} limit of {limit}; it must be positive.")
            if np.isinf(limit):
                missing.append(f"{name} of '{joint.name}'")
    if missing:
        raise Inconclusive(f"the model has no limits for {', '.join(missing)}; state them if the file format can")


def limits_are_in_radians(subject: RobotUnderTest) -> None:
    """Position and velocity limits are plausible in radians and meters. 'frobs doctor robot' shows the details."""
    facts = joint_facts(subject.model, home_positions(subject.model, {}))
    _expect_none(joint_findings(subject.model, facts), "limits-in-degrees")
    for joint in subject.model.actuated_joints:
        limits, prismatic = joint.limits, joint.type is JointType.PRISMATIC
        if joint.type is JointType.CONTINUOUS:
            continue  # wheels and rotors
        span = max(abs(limits.lower), abs(limits.upper))
        expect(
            not prismatic or not _FARTHEST < span < np.inf,
            f"the position limits of joint '{joint.name}' reach {span:.3g} m; specify limits in meters.",
        )
        fastest, unit = _FASTEST[prismatic]
        expect(
            not fastest < limits.velocity < np.inf,
            f"joint '{joint.name}' has a velocity limit of {limits.velocity:.3g} {unit}; specify limits in {unit}.",
        )


def home_is_inside_limits(subject: RobotUnderTest) -> None:
    """The home position contains only actuated joints, and each joint is within its limits."""
    home_positions(subject.model, subject.robot.home)


@after("home_is_inside_limits")
def home_is_above_floor(subject: RobotUnderTest) -> None:
    """In the home position of a fixed base, no link is below the floor that other joint positions would lift above it."""
    robot, model = subject.robot, subject.model
    if robot.base != "fixed":
        raise NotApplicable("the base is placed so that the robot stands on the floor")
    if robot.end_effectors and not robot.groups:
        raise NotApplicable("the robot is a tool, which an arm carries")
    home = home_positions(model, robot.home)
    below = {link: height for link, height in lowest_points(model, home, _UPRIGHT).items() if height < _BELOW}
    if below:
        heights = [lowest_points(model, posture, _UPRIGHT) for posture in random_postures(model, _LIFTS)]
        below = {link: height for link, height in below.items() if max(each[link] for each in heights) > 0.0}
    lowest = min(below, key=below.__getitem__, default="")
    expect(
        not below,
        f"in the home position, {len(below)} links reach below the floor, and the lowest is '{lowest}' at "
        f"{below.get(lowest, 0.0):.3g} m; choose another home position (home={{…}}), or raise the robot in the "
        "environment (pose={'pos': [0, 0, "
        f"{-below.get(lowest, 0.0):.3g}]}}).",
    )


@after("home_is_inside_limits")
def efforts_hold_home(subject: RobotUnderTest) -> None:
    """The effort limits are large enough to hold the home position of a fixed base against gravity."""
    if subject.robot.base != "fixed":
        raise NotApplicable("the base can tilt and move")
    facts = joint_facts(subject.model, home_positions(subject.model, subject.robot.home))
    _expect_none(joint_findings(subject.model, facts), "too-weak")


def tcp_moves(subject: RobotUnderTest) -> None:
    """The tool center point is a link that moves with the joints, except on a wheeled robot."""
    model = subject.model
    tcp = subject.robot.tcp or default_tcp(model)
    names = [link.name for link in model.links]
    expect(tcp in names, f"tcp '{tcp}' is not a link; available: {', '.join(names)}.")
    if subject.robot.base == "wheeled":
        return
    home = home_positions(model, subject.robot.home)
    poses = np.concatenate(model.frame_pose(tcp, np.stack([home, home + 0.1])), axis=1)
    moves = np.abs(poses[0] - poses[1]).max() > 1e-6
    if not moves and not subject.robot.groups and tcp in (tool.tcp for tool in subject.robot.end_effectors.values()):
        raise NotApplicable("the robot is a tool, which only the joints of an arm can move")
    expect(moves, f"no joint moves the tcp '{tcp}'; choose a link at the end of the kinematic chain.")
    fixed = {joint.name for joint in joint_path(model, tcp)}
    for name in names:
        path = joint_path(model, name)
        beyond = [joint.name for joint in path if joint.name in model.joint_names and joint.name not in fixed]
        on_chain = tcp in [joint.parent for joint in path]
        moves_gripper = len(beyond) < 2 and not (
            beyond and usual_rank(name)
        )  # a joint after the tcp may move a gripper
        expect(
            not on_chain or moves_gripper,
            f"joints {', '.join(beyond)} move the link '{name}' but not the tcp '{tcp}', which is closer to the "
            "base; choose a link at the end of the kinematic chain.",
        )


def tcp_is_the_tool(subject: RobotUnderTest) -> None:
    """If a link with a typical tool name is fixed to the tool center point's link, both links have the same origin."""
    robot, model = subject.robot, subject.model
    tcp = robot.tcp or default_tcp(model)
    if usual_rank(tcp) or robot.base == "wheeled":
        return
    home = home_positions(model, robot.home)[None]
    at = model.frame_pose(tcp, home)[0]
    for link in model.links:
        path = joint_path(model, link.name)
        parents = [joint.parent for joint in path]
        if not usual_rank(link.name) or tcp not in parents:
            continue
        distance = float(np.linalg.norm(model.frame_pose(link.name, home)[0] - at))
        moves = any(joint.type is not JointType.FIXED for joint in path[parents.index(tcp) :])
        expect(
            moves or distance < _NEAR,
            f"the origin of the tcp '{tcp}' is {distance:.3g} m from the origin of the tool '{link.name}', which is "
            f"fixed to the tcp; set tcp='{link.name}', or choose the link at the tool's working point.",
        )


def inertias_are_possible(subject: RobotUnderTest) -> None:
    """Masses are positive, and principal moments of inertia are positive and satisfy the triangle inequality."""
    for link in subject.model.links:
        if link.inertial is None:
            continue
        mass = link.inertial.mass
        expect(
            mass > 0,
            f"link '{link.name}' has a mass of {mass} kg; set a positive mass, or remove the link's inertial element.",
        )
        moments = np.linalg.eigvalsh(inertia_matrix(link.inertial))
        text = ", ".join(f"{moment:.3g}" for moment in moments)
        expect(
            moments[0] > 0,
            f"link '{link.name}' has the principal moments of inertia {text} kg·m²; all must be positive.",
        )
        expect(
            moments[0] + moments[1] >= moments[2] * (1 - 1e-6),
            f"link '{link.name}' has the principal moments of inertia {text} kg·m²; none may exceed the sum of the "
            "other two.",
        )


def inertias_fit_sizes(subject: RobotUnderTest) -> None:
    """Moments of inertia have the order of magnitude of the link's mass and size, so they are in kg·m²."""
    model = subject.model
    significant = is_significant(model)
    lengths = [float(np.linalg.norm(joint.origin.pos)) for joint in model.joints]
    for link in model.links:
        if link.inertial is None or link.inertial.mass <= 0.0 or not significant(link.inertial):
            continue  # the check inertias_are_possible reports masses that are not positive
        bounds = link_bounds(link)
        # without a shape, a link is at most as large as the robot, and nothing limits how small it is
        size = sum(lengths) + 1.0 if bounds is None else 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
        low, high = 0.0 if bounds is None else _GYRATION[0] * size, _GYRATION[1] * max(size, 1e-3)
        moment = float(np.linalg.eigvalsh(inertia_matrix(link.inertial))[-1])
        radius = np.sqrt(max(moment, 0.0) / link.inertial.mass)
        expect(
            low <= radius <= high,
            f"link '{link.name}' has a moment of inertia of {moment:.3g} kg·m² and a mass of {link.inertial.mass:.3g} "
            f"kg, as if its mass were {radius:.3g} m away from its center; the link's size is about {2 * size:.3g} m. "
            "Specify inertias in kg·m² (1 g·mm² is 1e-9 kg·m²).",
        )


def masses_fit_shapes(subject: RobotUnderTest) -> None:
    """Masses and inertias are plausible for the links' shapes. The command 'frobs doctor robot' shows the details."""
    _expect_none(body_findings(subject.model), "absurd-mass", "far-center", "too-large", "turned-inertia")


def moving_links_touch(subject: RobotUnderTest) -> None:
    """All moving links with visuals and significant mass have a collision shape, so that they can touch objects."""
    if not any(link.collisions for link in subject.model.links):
        raise Inconclusive("no link has a collision shape, so the robot passes through everything")
    inertials = {link.name: link.inertial for link in subject.model.links if link.inertial is not None}
    light = _LIGHT * sum(inertial.mass for inertial in inertials.values())
    heavy = {f"link '{name}'" for name, inertial in inertials.items() if inertial.mass > light}
    _expect_none([one for one in body_findings(subject.model) if one.about in heavy], "visual-only")


def _expect_none(findings: Iterable[Finding], *codes: str) -> None:
    odd = [one for one in findings if one.code in codes and one.severity is not Severity.NOTE]
    expect(not odd, "; ".join(f"{one.about}: {one.problem}; {one.advice}" for one in odd) + ".")


def notes_are_none(subject: RobotUnderTest) -> None:
    """The model file can be read without repairing or ignoring elements."""
    faults = [note for note in subject.model.notes if note.fault]
    notes, advice = "; ".join(map(str, faults)), "; ".join(dict.fromkeys(map(note_advice, faults)))
    expect(not faults, f"reading {subject.model.path.name}: {notes}. To fix: {advice}.")


def gains_are_positive(subject: RobotUnderTest) -> None:
    """All joints have a damping gain and, unless the robot is wheeled, a stiffness gain."""
    gains, model = subject.gains, subject.model
    for owner in (gains.stiffness, gains.damping):
        named = () if isinstance(owner, float | int) else owner
        unknown = [name for name in named if name not in model.joint_names]
        expect(not unknown, f"the gains contain {unknown}, but the actuated joints are {', '.join(model.joint_names)}.")
    for name in model.joint_names:
        kp, kd = gains.of(name)
        expect(kd > 0, f"joint '{name}' has a damping gain of {kd}; it must be positive.")
        expect(kp >= 0, f"joint '{name}' has a stiffness of {kp}; it must not be negative.")
        expect(
            kp > 0 or subject.robot.base == "wheeled", f"joint '{name}' has no stiffness, so it cannot hold a position."
        )


@after("gains_are_positive")
def gains_suit_the_masses(subject: RobotUnderTest) -> None:
    """The drives are stiff enough to follow commands, are damped, and do not creep."""
    model = subject.model
    home = home_positions(model, subject.robot.home)
    usual, moved = default_gains(model, home), composite_inertia(model, home)
    postures = [home, *random_postures(model, _POSTURES)]
    weights = np.abs([gravity_efforts(model, posture) for posture in postures]).max(axis=0)
    for joint in model.actuated_joints:
        name, (kp, kd) = joint.name, subject.gains.of(joint.name)
        default_kp, default_kd = usual.of(name)
        least, most = (share * default_kd for share in _DAMPING)
        if kp == 0.0:  # a wheel
            expect(
                least <= kd <= most,
                f"the damping gain of joint '{name}' is {kd:.3g}, but {default_kd:.3g} would suit the mass that the "
                "joint moves.",
            )
            continue
        inertia = moved[name] + subject.robot.armature.get(name, joint.armature)
        expect(
            kp >= max(_SOFTEST * default_kp, _SLOWEST_OMEGA**2 * inertia),
            f"the stiffness of joint '{name}' is {kp:.3g}, which is too soft for the mass that the joint moves; "
            f"{default_kp:.3g} would suit it.",
        )
        sag = weights[model.joint_names.index(name)] / kp
        expect(
            subject.robot.base != "fixed" or sag <= _SAG,
            f"the weight that joint '{name}' carries bends it by up to {sag:.3g} rad or m, because its stiffness is only "
            f"{kp:.3g}.",
        )
        ratio = kd / (2.0 * np.sqrt(kp * inertia))
        expect(
            ratio >= _RINGING,
            f"joint '{name}' oscillates: its damping ratio is {ratio:.2g} with a damping gain of {kd:.3g}; "
            f"{2.0 * np.sqrt(kp * inertia):.3g} damps it critically.",
        )
        expect(
            kd <= _SLOWEST * kp,
            f"joint '{name}' creeps to its target with a time constant of {kd / kp:.3g} s; reduce its damping gain of "
            f"{kd:.3g} or increase its stiffness of {kp:.3g}.",
        )


def parts_exist(subject: RobotUnderTest) -> None:
    """The base, friction, armature and differential drive settings are valid and refer to existing links and joints."""
    robot, model = subject.robot, subject.model
    expect(
        robot.base in ("fixed", "floating", "wheeled"),
        f"the robot's base is '{robot.base}'; expected 'fixed', 'floating' or 'wheeled'.",
    )
    links = [link.name for link in model.links]
    moving = [joint.name for joint in model.joints if joint.type is not JointType.FIXED]
    tables = (("friction", robot.friction, "link", links), ("armature", robot.armature, "joint", moving))
    for what, values, kind, known in tables:
        for name, value in values.items():
            expect(name in known, f"the robot's '{what}' has an entry for '{name}', which is not a {kind}.")
            expect(0 <= value < np.inf, f"the {what} of '{name}' is {value}; it must be finite and not negative.")
    drive = robot.differential_drive
    if drive is not None:
        unknown = [joint for joint in (*drive.left, *drive.right) if joint not in model.joint_names]
        expect(
            drive.left and drive.right and not unknown,
            "differential_drive must list existing joints as left and right wheels, but it lists "
            f"{unknown or 'no wheel'}.",
        )
        numbers = (drive.separation, drive.wheel_radius, drive.max_linear_velocity, drive.max_angular_velocity)
        accelerations = [a for a in (drive.max_linear_acceleration, drive.max_angular_acceleration) if a is not None]
        expect(
            min(*numbers, *accelerations) > 0, f"differential_drive contains a number that is not positive: {drive}."
        )
        wheels = [joint.limits.velocity for joint in model.joints if joint.name in (*drive.left, *drive.right)]
        fastest = min(wheels) * drive.wheel_radius  # [m/s]
        for what, needed in (
            ("max_linear_velocity", drive.max_linear_velocity),
            ("max_angular_velocity", 0.5 * drive.separation * drive.max_angular_velocity),
        ):
            expect(
                needed <= 1.05 * fastest,
                f"{what} needs wheels that roll at {needed:.3g} m/s, but their velocity limit allows {fastest:.3g} m/s.",
            )


def groups_and_tools_are_valid(subject: RobotUnderTest) -> None:
    """Joint groups do not overlap, and default controllers and end effectors refer to existing groups, links and joints."""
    robot, model = subject.robot, subject.model
    groups, limits = joint_groups(robot, model), {joint.name: joint.limits for joint in model.actuated_joints}
    for group, controller in robot.default_controllers.items():
        expect(group in groups, f"default_controllers contains '{group}', but the groups are {', '.join(groups)}.")
        plugins.get_record("controller", controller)
    for name, tool in robot.end_effectors.items():
        what = f"end effector '{name}'"
        links = [link.name for link in model.links]
        expect(tool.tcp in links, f"the tcp '{tool.tcp}' of {what} is not a link; available: {', '.join(links)}.")
        for group in {tool.arm, tool.group} - {""}:
            expect(group in groups, f"{what} refers to the group '{group}', but the groups are {', '.join(groups)}.")
        own = groups[tool.group] if tool.group else model.joint_names
        for state in ("open", "closed"):
            for joint, position in getattr(tool, state).items():
                where = f"the {state} position of joint '{joint}' of {what}"
                expect(joint in own, f"{where} is not that of a joint of the tool; available: {', '.join(own)}.")
                low, high = limits[joint].lower, limits[joint].upper
                expect(low - 1e-9 <= position <= high + 1e-9, f"{where} is {position}, outside of [{low}, {high}].")


def fingers_close(subject: RobotUnderTest) -> None:
    """The fingers of an end effector are closer together in the closed position than in the open position."""
    robot, model = subject.robot, subject.model
    compared = False
    for name, tool in robot.end_effectors.items():
        joints = robot.groups.get(tool.group, () if tool.group else model.joint_names)
        gaps = [_gap(model, joints, home_positions(model, {**robot.home, **at})) for at in (tool.closed, tool.open)]
        if not tool.open or tool.open == tool.closed or gaps[0] is None or gaps[1] is None:
            continue
        compared = True
        expect(
            abs(gaps[1] - gaps[0]) > _STILL,
            f"the fingers of end effector '{name}' are {gaps[0]:.3g} m apart when closed and when open, because they move "
            "in the same direction; turn the axis of one joint, or change the sign of its multiplier.",
        )
        expect(
            gaps[0] < gaps[1],
            f"the fingers of end effector '{name}' are {gaps[0]:.3g} m apart when closed and {gaps[1]:.3g} m apart "
            "when open; swap the joint positions in open and closed.",
        )
    if not compared:
        raise NotApplicable("the robot has no end effector with two fingers")


def _gap(model: RobotModel, joints: Sequence[str], positions: Floats) -> float | None:
    """Return the mean distance [m] between the parts that the given joints move, or None for fewer than two parts."""
    fingers: dict[str, list[Floats]] = {}  # for each joint, the centers of the links that it moves
    for link in model.links:
        leaders = [(joint.name, model.leader(joint)) for joint in joint_path(model, link.name)]
        first = next((name for name, leader in leaders if leader is not None and leader.joint in joints), None)
        if first is not None:
            bounds = link_bounds(link)
            center = np.zeros(3) if bounds is None else np.mean(bounds, axis=0)
            pos, quat = model.frame_pose(link.name, positions[None])
            fingers.setdefault(first, []).append((pos + quat_rotate(quat, center[None]))[0])
    centers = [np.mean(parts, axis=0) for parts in fingers.values()]
    pairs = [float(np.linalg.norm(one - other)) for one, other in combinations(centers, 2)]
    return sum(pairs) / len(pairs) if pairs else None


def end_effectors_attach(subject: RobotUnderTest) -> None:
    """A tool attached to an arm keeps its mass, home position, tool center point, and open and closed positions."""
    tool, model = subject.robot, subject.model
    if not tool.end_effectors or tool.groups or model.format != "urdf":
        raise NotApplicable("the robot is not a tool that can be attached to an arm")
    arm, at = replace(ARM, model=str(model_of(ARM.model).path)), (0.1, -0.2, 0.3)
    arm_with_tool = arm.attach("tool", tool, name="kit", pos=at)
    joined = load_model(arm_with_tool.model)
    effector, described = arm_with_tool.end_effectors["kit"], next(iter(tool.end_effectors.values()))
    names = tuple(f"kit_{joint}" for joint in model.joint_names)
    expect(
        arm_with_tool.groups.get("kit", ()) == names,
        f"the joint group of the attached tool is {arm_with_tool.groups.get('kit')}; expected {names}.",
    )
    models = (joined, model, model_of(ARM.model))
    masses = [sum(link.inertial.mass for link in each.links if link.inertial) for each in models]
    expect_close(masses[1] + masses[2], masses[0], 1e-9, "mass of an arm with the tool [kg]")
    home = home_positions(joined, arm_with_tool.home)
    own = home_positions(model, tool.home)
    places = [joined.joint_names.index(name) for name in names]
    expect_close(own, home[places], 1e-12, "home position of the attached tool")
    for state in ("open", "closed"):
        expected = {f"kit_{joint}": value for joint, value in getattr(described, state).items()}
        actual = getattr(effector, state)
        expect(actual == expected, f"the {state} positions of the attached tool are {actual}; expected {expected}.")
    frames = {link: joined.frame_pose(link, home[None])[0][0] for link in ("tool", effector.tcp)}
    turn = joined.frame_pose("tool", home[None])[1]
    tip = quat_rotate(turn, (np.array(at) + model.frame_pose(described.tcp, own[None])[0][0])[None])[0]
    expect_close(frames["tool"] + tip, frames[effector.tcp], 1e-9, "tool center point of the attached tool [m]")

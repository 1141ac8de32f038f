"""Data classes for the doctor's report on a robot's file, which define the schema of the ``--json`` output."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

from frobs_models import Gripper

Vector: TypeAlias = tuple[float, ...]

FORMAT = 1
"""Version of the JSON format, which increases when a key is removed or changes its meaning."""


class Severity(Enum):
    """Severity of a finding.

    An error prevents the use of the robot or plugin, and a warning indicates unexpected behavior.
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True)
class Finding:
    """One problem or noteworthy fact.

    Attributes:
        code: Kind of the finding: a code such as ``"overlap-at-home"``, or the rule that the file reader applied.
        severity: Severity of the finding.
        about: Affected object, such as ``"link 'forearm'"``.
        problem: Description of the problem.
        advice: How to fix the problem. May be empty in a note.
        line: 1-based line number in the file, or None if unknown.
    """

    code: str
    severity: Severity
    about: str
    problem: str
    advice: str = ""
    line: int | None = None


def warning(code: str, about: str, problem: str, advice: str) -> Finding:
    """Return a finding with the severity ``WARNING``."""
    return Finding(code, Severity.WARNING, about, problem, advice)


@dataclass(frozen=True, kw_only=True)
class DriveFacts:
    """The default drive of a joint, which is used if the robot's description does not declare gains.

    Attributes:
        inertia: Largest inertia that the joint moves [kg·m² or kg]. The drive is critically damped at this inertia.
        stiffness: Proportional gain Kp [N·m/rad or N/m].
        damping: Derivative gain Kd [N·m·s/rad or N·s/m].
        bandwidth: Bandwidth of the drive at ``inertia`` [Hz].
        time_constant: Time in which a position error decreases to about a third of its initial value [s].
        holding_effort: Effort that holds the joint against gravity at home, with an upright, fixed root [N·m or N].
    """

    inertia: float
    stiffness: float
    damping: float
    bandwidth: float
    time_constant: float
    holding_effort: float


@dataclass(frozen=True, kw_only=True)
class JointFacts:
    """Facts about a joint.

    Attributes:
        name: Name in the file.
        joint_type: ``revolute``, ``continuous``, ``prismatic``, ``fixed``, ``floating`` or ``planar``.
        parent: Parent link.
        child: Child link.
        unit: Unit of the joint's position: ``rad`` or ``m``, or an empty string if the joint has no position.
        axis: Joint axis, as a unit vector in the joint's frame.
        lower: Lower position limit [rad or m], or None if unlimited.
        upper: Upper position limit [rad or m], or None if unlimited.
        velocity: Velocity limit [rad/s or m/s], or None if unlimited.
        effort: Effort limit [N·m or N], or None if unlimited.
        damping: Damping coefficient [N·m·s/rad or N·s/m].
        friction: Dry friction [N·m or N].
        mimic: ``{"joint": …, "multiplier": …, "offset": …}`` if the joint follows another joint, otherwise None.
        home: Home position [rad or m], or None if the joint has no position.
        drive: Drive of the joint, or None if the joint is not driven.
    """

    name: str
    joint_type: str
    parent: str
    child: str
    unit: str
    axis: Vector
    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None
    damping: float
    friction: float
    mimic: dict[str, Any] | None
    home: float | None
    drive: DriveFacts | None


@dataclass(frozen=True, kw_only=True)
class LinkFacts:
    """Facts about a link.

    Attributes:
        name: Name in the file.
        mass: Mass [kg], or None if the file does not define a mass.
        center_of_mass: Center of mass in the link's frame [m], or None if the file does not define a mass.
        principal_moments: Principal moments of inertia in ascending order [kg·m²], or None if there is no mass.
        visuals: Number of visual shapes.
        collisions: Number of collision shapes.
        size: Edge lengths of the bounding box of the collision shapes, or of the visual shapes if no collision shape
            can be measured [m]. The value is None if no shape can be measured.
    """

    name: str
    mass: float | None
    center_of_mass: Vector | None
    principal_moments: Vector | None
    visuals: int
    collisions: int
    size: Vector | None


@dataclass(frozen=True, kw_only=True)
class ToolCandidate:
    """A candidate link for the tool center point, ``tcp``.

    Attributes:
        link: Name of the link.
        actuated_joints: Number of actuated joints that move the link.
        usual_name: Whether the link's name is a common tool name.
        reach: Largest distance from the root link that was found in random poses within the joint limits [m].
        longest_reach: Upper bound of the distance from the root link [m], or None if unbounded.
        chosen: Whether the link is used as the robot's ``tcp``.
    """

    link: str
    actuated_joints: int
    usual_name: bool
    reach: float
    longest_reach: float | None
    chosen: bool


@dataclass(frozen=True)
class Difference:
    """A quantity whose value in FRobs differs from the value in the file.

    Attributes:
        about: Affected link or joint, such as ``"link 'forearm'"``.
        quantity: Name of the quantity, such as ``"mass"``, ``"inertia"`` or ``"effort limit"``.
        file: Value in the file, or None if the value is missing.
        used: Value that FRobs uses instead, or None if there is no value or no limit.
    """

    about: str
    quantity: str
    file: Any
    used: Any


@dataclass(frozen=True)
class TranslatedElement:
    """How a simulator represents one kind of model element.

    Attributes:
        element: Kind of the element, which is a key of ``frobs_models.ELEMENTS``.
        names: Names of the links or joints to which the translation applies.
        treatment: ``kept``, ``approximated``, ``dropped``, or ``unknown`` if the simulator does not report it.
        how: Replacement of the element, or description of what is lost.
        changes_motion: Whether the translation changes the robot's motion.
    """

    element: str
    names: tuple[str, ...]
    treatment: str
    how: str
    changes_motion: bool = False


@dataclass(frozen=True, kw_only=True)
class SimulatorFacts:
    """Representation of the robot in an installed simulator.

    Attributes:
        name: Name of the simulator.
        distribution: The pip package that provides the simulator.
        version: Version of the distribution.
        builds: Whether the simulator can build the robot, or None if building was not attempted.
        reason: Why the simulator cannot build the robot, or why building was not attempted.
        overlaps: Pairs of links that overlap at home, as ``{"first", "second", "depth"}`` in meters, or None.
        elements: Translations of the elements in the file.
    """

    name: str
    distribution: str
    version: str
    builds: bool | None
    reason: str
    overlaps: tuple[dict[str, Any], ...] | None
    elements: tuple[TranslatedElement, ...]

    @property
    def complete(self) -> bool:
        """Whether the simulator builds the robot and supports all elements that affect the robot's motion."""
        return bool(self.builds) and not any(row.changes_motion for row in self.elements)


@dataclass(frozen=True, kw_only=True)
class RobotReport:
    """The doctor's report on a robot's file.

    Attributes:
        format: Version of this schema.
        file: Path of the file.
        file_format: ``urdf`` or ``mjcf``. A xacro file is a URDF file with macros.
        name: The robot's name.
        usable: Whether none of the findings is an error.
        dof: Number of actuated joints.
        root: Name of the root link.
        mass: Total mass of all links [kg].
        size: Edge lengths of the robot's bounding box in the home position [m].
        findings: Findings, most severe first.
        joints: All joints, in file order.
        links: All links, in file order.
        tools: Candidate links for the tool center point, most likely first.
        gripper: The gripper that manipulation tasks use, found from the shapes of the links, or None.
        no_gripper: Why no gripper was found, or an empty string.
        differences: Quantities whose values in FRobs differ from the values in the file.
        simulators: Representation of the robot in each examined simulator.
    """

    format: int = FORMAT
    file: str
    file_format: str
    name: str
    usable: bool
    dof: int
    root: str
    mass: float
    size: Vector
    findings: tuple[Finding, ...]
    joints: tuple[JointFacts, ...]
    links: tuple[LinkFacts, ...]
    tools: tuple[ToolCandidate, ...]
    gripper: Gripper | None = None
    no_gripper: str = ""
    differences: tuple[Difference, ...]
    simulators: tuple[SimulatorFacts, ...]

"""The doctor's report on a robot's file: facts and findings as data. This is the schema of ``--json``."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

Vector: TypeAlias = tuple[float, ...]

FORMAT = 1
"""Version of the JSON format. It increases when a key is removed or changes its meaning."""


class Severity(Enum):
    """Severity of a finding. An error prevents use of the robot, a warning indicates unexpected behavior."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    def __str__(self) -> str:
        """Return the human-readable word."""
        return self.value


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One problem or remarkable fact.

    Attributes:
        code: Kind of finding, for programs: ``"overlap-at-home"``, or the rule that the reader followed.
        severity: Severity of the finding.
        about: Affected object: ``"link 'forearm'"``.
        problem: Description of the problem.
        advice: How to fix it; may be empty in a note.
        line: 1-based line in the file, or None.
    """

    code: str
    severity: Severity
    about: str
    problem: str
    advice: str = ""
    line: int | None = None


def warning(code: str, about: str, problem: str, advice: str) -> Finding:
    """Return a finding with the severity warning."""
    return Finding(code=code, severity=Severity.WARNING, about=about, problem=problem, advice=advice)


@dataclass(frozen=True, kw_only=True)
class DriveFacts:
    """The default drive of a joint, used if the robot's description does not declare gains.

    Attributes:
        inertia: Inertia at which it is critically damped: the largest that the joint moves [kg·m² or kg].
        stiffness: Kp [N·m/rad or N/m]
        damping: Kd [N·m·s/rad or N·s/m]
        bandwidth: Bandwidth of the drive at that inertia [Hz].
        time_constant: Time in which an error decreases to about a third [s].
        holding_effort: Effort that holds the joint against gravity at home, with the root upright and fixed [N·m or N].
    """

    inertia: float
    stiffness: float
    damping: float
    bandwidth: float
    time_constant: float
    holding_effort: float


@dataclass(frozen=True, kw_only=True)
class JointFacts:
    """A joint.

    Attributes:
        name: Name in the file.
        joint_type: ``revolute``, ``continuous``, ``prismatic``, ``fixed``, ``floating`` or ``planar``.
        parent: Parent link.
        child: Child link.
        unit: Unit of its position: ``rad`` or ``m``; empty if it has no position.
        axis: Unit vector in the joint's frame.
        lower: Lower limit [rad or m]; None: unlimited.
        upper: Upper limit [rad or m]; None: unlimited.
        velocity: Velocity limit [rad/s or m/s]; None: unlimited.
        effort: Effort limit [N·m or N]; None: unlimited.
        damping: [N·m·s/rad or N·s/m]
        friction: [N·m or N]
        mimic: ``{"joint": …, "multiplier": …, "offset": …}`` if it follows another joint, otherwise None.
        home: Home position [rad or m]; None if it has no position of its own.
        drive: Its drive; None if it has none.
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
    """A link.

    Attributes:
        name: Name in the file.
        mass: [kg]; None if the file does not define it.
        center_of_mass: In the link's frame [m]; None if the file does not define a mass.
        principal_moments: Principal moments of inertia, ascending [kg·m²]; None if the file does not define a mass.
        visuals: Number of visual shapes.
        collisions: Number of collision shapes.
        size: Edges of the bounding box of its collision shapes, or else of its visuals [m]; None if no shape exists or
            can be measured.
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
    """A link that may be the tool center point, ``tcp``.

    Attributes:
        link: Name of the link.
        actuated_joints: Number of joints that move it.
        usual_name: Whether its name is common for tools.
        reach: Largest distance from the root in random poses within the limits [m].
        longest_reach: Upper bound of its distance from the root [m]; None: unbounded.
        chosen: Whether it is the default of ``tcp``.
    """

    link: str
    actuated_joints: int
    usual_name: bool
    reach: float
    longest_reach: float | None
    chosen: bool


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A number for which FRobs does not use the file's value.

    Attributes:
        about: ``"link 'forearm'"``.
        quantity: ``"mass"``, ``"inertia"``, ``"effort limit"``, …
        file: Value in the file; None: missing.
        used: Value that is used instead; None: none, or unlimited.
    """

    about: str
    quantity: str
    file: Any
    used: Any


@dataclass(frozen=True, kw_only=True)
class TranslatedElement:
    """Translation of one kind of element in a simulator.

    Attributes:
        element: A key of ``frobs_core.models.ELEMENTS``.
        names: Links or joints that have it and to which this applies.
        treatment: ``kept``, ``approximated``, ``dropped``, or ``unknown`` if the simulator does not report it.
        how: Its replacement, or what is lost.
        changes_motion: Whether it makes the robot move differently.
    """

    element: str
    names: tuple[str, ...]
    treatment: str
    how: str
    changes_motion: bool = False


@dataclass(frozen=True, kw_only=True)
class SimulatorFacts:
    """How an installed simulator represents the robot.

    Attributes:
        name: Name of the simulator.
        distribution: The pip package that provides it.
        version: Version of the distribution.
        builds: Whether it can simulate the robot; None: not tried.
        reason: Why it cannot, or why it was not tried.
        overlaps: Links that overlap at home: ``{"first", "second", "depth"}`` [m]; None: unknown.
        elements: Translation of the elements in the file.
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
        """Whether it simulates the robot with all elements that affect its motion."""
        return bool(self.builds) and not any(row.changes_motion for row in self.elements)


@dataclass(frozen=True, kw_only=True)
class RobotReport:
    """The doctor's report on a robot's file.

    Attributes:
        format: Version of this schema.
        file: The file.
        file_format: ``urdf`` or ``mjcf``; a xacro file is a URDF with macros.
        name: The robot's name.
        usable: Whether the findings contain no error.
        dof: Number of actuated joints.
        root: Name of the root link.
        mass: Total mass of all links [kg].
        size: Edges of the robot's bounding box at home [m].
        findings: Problems, most severe first.
        joints: All joints, in file order.
        links: All links, in file order.
        tools: Links that may be the tool, likeliest first.
        differences: Numbers for which FRobs does not use the file's value.
        simulators: How each installed simulator represents the robot.
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
    differences: tuple[Difference, ...]
    simulators: tuple[SimulatorFacts, ...]

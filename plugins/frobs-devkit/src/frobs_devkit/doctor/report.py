"""What the doctor says about a robot's file: facts and findings, as data. This is the schema of ``--json``."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

Vector: TypeAlias = tuple[float, ...]

FORMAT = 1
"""Of the JSON; it is raised when a key changes its meaning or goes."""


class Severity(Enum):
    """How bad a finding is: an error keeps the robot from being used, a warning makes it behave oddly."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"

    def __str__(self) -> str:
        """Return the word that people read."""
        return self.value


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that is wrong, or worth knowing.

    Attributes:
        code: Of this kind of finding, for programs: ``"overlap-at-home"``, or the rule of the reader that was followed.
        severity: How bad it is.
        about: What it is about: ``"link 'forearm'"``.
        problem: What is wrong.
        advice: What to do; may be empty in a note.
        line: 1-based line in the file, or None.
    """

    code: str
    severity: Severity
    about: str
    problem: str
    advice: str = ""
    line: int | None = None


def warning(code: str, about: str, problem: str, advice: str) -> Finding:
    """Return a finding that is a warning."""
    return Finding(code=code, severity=Severity.WARNING, about=about, problem=problem, advice=advice)


@dataclass(frozen=True, kw_only=True)
class DriveFacts:
    """The drive that a joint gets where the robot's description declares no gains.

    Attributes:
        inertia: With which it is critically damped: the largest that the joint moves [kg·m² or kg].
        stiffness: Kp [N·m/rad or N/m]
        damping: Kd [N·m·s/rad or N·s/m]
        bandwidth: Of the drive with that inertia [Hz].
        time_constant: In which an error falls to a third and a little [s].
        holding_effort: What gravity asks of the joint at home, the root upright and fixed [N·m or N].
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
        name: In the file.
        joint_type: ``revolute``, ``continuous``, ``prismatic``, ``fixed``, ``floating`` or ``planar``.
        parent: Link that carries it.
        child: Link that it moves.
        unit: Of its position: ``rad`` or ``m``; empty where it has none.
        axis: Unit vector in the joint's frame.
        lower: Limit [rad or m]; None: none.
        upper: Limit [rad or m]; None: none.
        velocity: Limit [rad/s or m/s]; None: none.
        effort: Limit [N·m or N]; None: none.
        damping: [N·m·s/rad or N·s/m]
        friction: [N·m or N]
        mimic: ``{"joint": …, "multiplier": …, "offset": …}`` where it follows another, else None.
        home: Where it rests [rad or m]; None: it has no position of its own.
        drive: Its drive; None: it has none.
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
        name: In the file.
        mass: [kg]; None: the file gives none.
        center_of_mass: In the link's frame [m]; None: the file gives no mass.
        principal_moments: Of inertia, ascending [kg·m²]; None: the file gives no mass.
        visuals: How many shapes are drawn.
        collisions: How many shapes touch things.
        size: Edges of the box around its collision shapes, or else around what is drawn [m]; None: no shape, or none
            that could be measured.
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
    """A link that may be the tool centre point, ``tcp``.

    Attributes:
        link: Its name.
        actuated_joints: How many joints move it.
        usual_name: Whether tools are called so.
        reach: The farthest from the root that it came in random poses within the limits [m].
        longest_reach: The distance from the root that it never exceeds [m]; None: no bound.
        chosen: Whether it is taken where nobody says ``tcp=…``.
    """

    link: str
    actuated_joints: int
    usual_name: bool
    reach: float
    longest_reach: float | None
    chosen: bool


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A number that is not used as the file has it.

    Attributes:
        about: ``"link 'forearm'"``.
        quantity: ``"mass"``, ``"inertia"``, ``"effort limit"``, …
        file: What the file says; None: nothing.
        used: What is used instead; None: nothing, or no limit.
    """

    about: str
    quantity: str
    file: Any
    used: Any


@dataclass(frozen=True, kw_only=True)
class TranslatedElement:
    """What becomes of one kind of element in a simulator.

    Attributes:
        element: A key of ``frobs_core.models.ELEMENTS``.
        names: The links or joints that have it, and that this holds for.
        treatment: ``kept``, ``approximated``, ``dropped``, or ``not told`` by the simulator.
        how: What it becomes, or what is lost.
        changes_motion: Whether the robot moves differently because of it.
    """

    element: str
    names: tuple[str, ...]
    treatment: str
    how: str
    changes_motion: bool = False


@dataclass(frozen=True, kw_only=True)
class SimulatorFacts:
    """What an installed simulator makes of the robot.

    Attributes:
        name: Of the simulator.
        distribution: The pip package that offers it.
        version: Of the distribution.
        builds: Whether it can simulate the robot; None: that was not tried.
        reason: Why it cannot, or why it was not tried.
        overlaps: Links that are in each other at home: ``{"first", "second", "depth"}`` [m]; None: not told.
        elements: What becomes of the file.
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
        """Whether it simulates the robot, and everything in the file that changes the motion."""
        return bool(self.builds) and not any(row.changes_motion for row in self.elements)


@dataclass(frozen=True, kw_only=True)
class RobotReport:
    """Everything that the doctor says about a robot's file.

    Attributes:
        format: Version of this schema.
        file: The file.
        file_format: ``urdf`` or ``mjcf``; a xacro is a URDF with macros.
        name: The robot's name.
        usable: Whether there is no error among the findings.
        dof: Actuated joints.
        root: Name of the root link.
        mass: Of all links together [kg].
        size: Edges of the box around the robot at home [m].
        findings: What is wrong, the worst first.
        joints: All joints, in file order.
        links: All links, in file order.
        tools: Which links may be the tool, the likeliest first.
        differences: Every number that is not used as the file has it.
        simulators: What each installed simulator makes of the robot.
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

"""What was done to a model file when it was read: each departure from the file is a note, and each note obeys a rule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from frobs_core.models.xmltree import Element


class Treatment(Enum):
    """What becomes of an element of a model file."""

    KEPT = "kept"
    APPROXIMATED = "approximated"
    DROPPED = "dropped"


@dataclass(frozen=True, kw_only=True)
class Rule:
    """How one peculiarity of model files is treated.

    Attributes:
        name: Of the rule: ``"impossible-inertia"``.
        about: What the file says, or leaves out.
        treatment: What becomes of it.
        text: What is done.
        fault: Whether the author of the file should mend it; a robot's conformance check fails where one should.
    """

    name: str
    about: str
    treatment: Treatment
    text: str
    fault: bool = False


@dataclass(frozen=True)
class Note:
    """One thing that a model does not hold as its file says it, or that is worth knowing.

    Attributes:
        element: What it is about, as the file has it: ``<link name="forearm">``.
        rule: Name of the rule that was followed, a key of ``RULES``.
        text: What was found and done, without the element.
        line: 1-based line in the file, or None where it is not known (a xacro, or the whole file).
    """

    element: str
    rule: str
    text: str
    line: int | None = None

    @property
    def treatment(self) -> Treatment:
        """What became of the element."""
        return RULES[self.rule].treatment

    @property
    def fault(self) -> bool:
        """Whether the author of the file should mend it."""
        return RULES[self.rule].fault

    def __str__(self) -> str:
        """Return one line: ``<link name="forearm">: text``."""
        return f"{self.element}: {self.text}"


class Notes(list[Note]):
    """Notes while a file is read."""

    def add(self, rule: str, element: Element, text: str) -> None:
        """Note what was done to an element.

        Args:
            rule: Name of the rule.
            element: What it is about.
            text: What was found and done.
        """
        assert rule in RULES
        self.append(Note(element.named(), rule, text, element.line))


def _rules(*rules: Rule) -> Mapping[str, Rule]:
    return {rule.name: rule for rule in rules}


_KEPT, _APPROXIMATED, _DROPPED = Treatment.KEPT, Treatment.APPROXIMATED, Treatment.DROPPED

RULES: Mapping[str, Rule] = _rules(
    Rule(
        name="unnamed",
        about="a robot, body or joint without a name",
        treatment=_KEPT,
        text="it is called after the file, or by its kind and a number",
    ),
    Rule(
        name="unknown",
        about="an element or attribute that is not of URDF",
        treatment=_DROPPED,
        text="left out",
        fault=True,
    ),
    Rule(
        name="gazebo",
        about="`<gazebo>`",
        treatment=_DROPPED,
        text="left out: its friction, colours, sensors and plugins are instructions for Gazebo",
    ),
    Rule(
        name="transmission",
        about="`<transmission>`",
        treatment=_DROPPED,
        text="left out: drives act on the joints, so reductions and rotor inertias are not simulated",
    ),
    Rule(
        name="ros-control",
        about="`<ros2_control>`",
        treatment=_DROPPED,
        text="left out: it describes the interfaces of the hardware",
    ),
    Rule(
        name="safety-controller",
        about="`<safety_controller>`",
        treatment=_DROPPED,
        text="left out: its soft limits are a controller's; the limits of `<limit>` hold",
    ),
    Rule(
        name="calibration",
        about="`<calibration>`",
        treatment=_DROPPED,
        text="left out: positions are absolute",
    ),
    Rule(
        name="sensor",
        about="`<sensor>` (URDF and MJCF)",
        treatment=_DROPPED,
        text="left out: sensors stand in the robot's description",
    ),
    Rule(
        name="contact-parameters",
        about="friction, stiffness and restitution of a link (`<contact>`, `<surface>`)",
        treatment=_DROPPED,
        text="left out: they are another engine's; each simulator has its own friction, the same for all links",
    ),
    Rule(
        name="engine-settings",
        about="settings of one engine (`<mujoco>`, `<drake>`, an MJCF's `<option>`)",
        treatment=_DROPPED,
        text="left out: time step, integrator and gravity are the environment's",
    ),
    Rule(
        name="no-effect",
        about="what has no meaning where it stands: a material of a collision shape, an `<origin>` of a link",
        treatment=_DROPPED,
        text="left out",
    ),
    Rule(
        name="texture",
        about="the texture of a material",
        treatment=_DROPPED,
        text="left out: the material's colour is drawn",
    ),
    Rule(
        name="colour-clipped",
        about="a colour outside of [0, 1]",
        treatment=_APPROXIMATED,
        text="clipped to [0, 1]",
        fault=True,
    ),
    Rule(
        name="undefined-material",
        about="a material that is named but not defined",
        treatment=_DROPPED,
        text="the visual has no colour of its own",
        fault=True,
    ),
    Rule(
        name="empty-shape",
        about="a sphere of radius 0",
        treatment=_DROPPED,
        text="left out: it touches and shows nothing",
        fault=True,
    ),
    Rule(
        name="no-range",
        about="a revolute or prismatic joint without `<limit>`, or with lower > upper, or both 0",
        treatment=_APPROXIMATED,
        text="taken as unlimited (a revolute one as continuous), as most engines do",
        fault=True,
    ),
    Rule(
        name="continuous-range",
        about="lower and upper limit of a continuous joint",
        treatment=_DROPPED,
        text="left out: a continuous joint has none",
        fault=True,
    ),
    Rule(
        name="no-cap",
        about="a velocity or effort limit of 0, or none",
        treatment=_APPROXIMATED,
        text="taken as unlimited: whoever writes 0 means that the number is not known",
        fault=True,
    ),
    Rule(
        name="no-mass",
        about="links that move and have no mass among them, or a mass of 0",
        treatment=_APPROXIMATED,
        text="1 g and 10⁻⁶ kg·m² at the joint: engines cannot move what weighs nothing",
        fault=True,
    ),
    Rule(
        name="zero-mass",
        about="a mass of 0",
        treatment=_DROPPED,
        text="its <inertial> is left out, as if it were not there",
        fault=True,
    ),
    Rule(
        name="no-inertia",
        about="a mass without moments of inertia, or with all of them 0",
        treatment=_APPROXIMATED,
        text="those of a solid sphere of 5 cm radius",
        fault=True,
    ),
    Rule(
        name="impossible-inertia",
        about="a principal moment of inertia below 0 or above the sum of the other two, which no rigid body has",
        treatment=_APPROXIMATED,
        text="the mean of the three about every axis",
        fault=True,
    ),
    Rule(
        name="thin-inertia",
        about="a principal moment of inertia of 0, or next to it: a body without any width",
        treatment=_APPROXIMATED,
        text="raised to 10⁻⁶ of the largest: engines need all three above 0",
        fault=True,
    ),
    Rule(
        name="free-root",
        about="what frees the root: a floating joint from the root link (URDF), a free joint of the root body (MJCF)",
        treatment=_DROPPED,
        text="whether the base moves is said by base='fixed', 'floating' or 'wheeled'",
    ),
    Rule(
        name="root-pose",
        about="the pose of the root body (MJCF)",
        treatment=_DROPPED,
        text="the scene says where the robot stands",
    ),
    Rule(
        name="actuators",
        about="`<actuator>` (MJCF)",
        treatment=_APPROXIMATED,
        text="replaced by the drive of each joint; the force ranges are its effort limits",
    ),
    Rule(
        name="keyframes",
        about="`<keyframe>` (MJCF)",
        treatment=_DROPPED,
        text="left out: home stands in the robot's description",
    ),
    Rule(
        name="mocap-body",
        about="a mocap body inside of the robot (MJCF)",
        treatment=_APPROXIMATED,
        text="taken as fixed",
        fault=True,
    ),
    Rule(
        name="mesh-mass",
        about="a body whose mass is that of its meshes (MJCF)",
        treatment=_KEPT,
        text="the engine weighs them; default drive gains leave them out",
        fault=True,
    ),
    Rule(
        name="engine-equality",
        about="an equality of joints that is no straight line, or not active (MJCF)",
        treatment=_KEPT,
        text="the engine's alone; the joints on both sides are driven",
        fault=True,
    ),
)
"""Every rule by name, in the order of the documentation's table."""

"""What a user states about a gripper. Everything that is not stated is found in the model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from frobs_core.models import RobotModel
from frobs_core.util.errors import ParameterValueError, check_name
from frobs_core.util.validation import validate

_ENOUGH = ("joints", "tcp", "open", "closed", "gap")
_ROUNDING = 2e-6  # [rad or m] by which a position may exceed a limit, because files state rounded positions
Positions = dict[str, FiniteFloat]
_Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class StatedTcp(BaseModel):
    """Tool center point relative to the palm: z is the direction of approach, and the fingers close along y.

    Attributes:
        pos: Position [m].
        rpy: Orientation as roll, pitch and yaw about fixed axes [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    pos: _Vector
    rpy: _Vector = (0.0, 0.0, 0.0)


class StatedGripper(BaseModel):
    """Settings of a gripper, all of which are optional.

    Attributes:
        joints: Actuated joints that move the fingers.
        arm: Actuated joints of the arm.
        palm: Link that carries the fingers.
        pads: Links that touch an object.
        fixed_jaw: Whether a single jaw closes on the palm.
        tcp: Tool center point.
        open: Positions of ``joints`` with the widest gap [rad or m].
        closed: Positions of ``joints`` with the narrowest gap [rad or m].
        gap: Distance between the pads of the closed and of the open gripper [m].
        levers: Motion of a pad per motion of each joint [m/rad or m/m], which determines the gains of the drives.
        controller: Default controller of the fingers.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    joints: tuple[str, ...] = ()
    arm: tuple[str, ...] = ()
    palm: str | None = None
    pads: tuple[str, ...] = ()
    fixed_jaw: bool | None = None
    tcp: StatedTcp | None = None
    open: Positions = {}
    closed: Positions = {}
    gap: tuple[Annotated[FiniteFloat, Field(ge=0.0)], Annotated[FiniteFloat, Field(gt=0.0)]] | None = None
    levers: dict[str, Annotated[FiniteFloat, Field(gt=0.0)]] = {}
    controller: str = "gripper_delta"

    @property
    def is_complete(self) -> bool:
        """Whether nothing has to be measured."""
        return all(getattr(self, name) for name in _ENOUGH)


def read_statement(model: RobotModel, settings: Mapping[str, Any]) -> StatedGripper:
    """Check what is stated about the gripper of a model.

    Raises:
        ConfigurationError: A key is unknown, a value is invalid, or contradicts the model.
    """
    stated = validate(StatedGripper, settings, f"the gripper of '{model.name}'")
    links, limits = [link.name for link in model.links], {joint.name: joint.limits for joint in model.actuated_joints}
    for link in (*stated.pads, *filter(None, [stated.palm])):
        check_name(f"link of '{model.name}'", link, links)
    for joint in (*stated.joints, *stated.arm):
        check_name(f"actuated joint of '{model.name}'", joint, limits)
    if both := {*stated.joints} & {*stated.arm}:
        raise ParameterValueError("gripper.arm", list(stated.arm), f"joints without those of the gripper ({min(both)})")
    for key in ("open", "closed", "levers"):
        values = getattr(stated, key)
        for joint in values:
            check_name(f"joint in gripper.{key} of '{model.name}'", joint, stated.joints or limits)
        if values and stated.joints and len(values) < len(stated.joints):
            raise ParameterValueError(f"gripper.{key}", values, f"a number for each of {', '.join(stated.joints)}")
        for joint, value in values.items() if key != "levers" else ():
            low, high = limits[joint].lower, limits[joint].upper
            if not low - _ROUNDING <= value <= high + _ROUNDING:
                raise ParameterValueError(f"gripper.{key}.{joint}", value, f"inside its limits [{low:g}, {high:g}]")
            values[joint] = min(max(value, low), high)
    for joint, value in stated.open.items():
        if value == stated.closed.get(joint):
            raise ParameterValueError(f"gripper.open.{joint}", value, "another position than that in gripper.closed")
    if stated.gap is not None and stated.gap[0] >= stated.gap[1]:
        raise ParameterValueError("gripper.gap", list(stated.gap), "the closed gap, and then a wider open gap [m]")
    return stated

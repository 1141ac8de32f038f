"""All tolerances of the certificate, with their reasons. Do not define tolerances in any other module."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Largest allowed difference between two simulators in one quantity.

    Attributes:
        exact: Tolerance if both simulators claim exact support of the relevant capability.
        approximate: Tolerance if at least one simulator only claims approximate support.
        unit: Unit of both tolerances.
        share: Whether ``approximate`` is a fraction of the range of the motion or reward, instead of a value in
            ``unit``.
        reason: Reason for both tolerances.
    """

    exact: float
    approximate: float
    unit: str
    share: bool = False
    reason: str

    def allowed(self, exact: bool, scale: float = 1.0) -> float:
        """Return the largest allowed error.

        Args:
            exact: Whether both simulators claim exact support.
            scale: Range of the motion or reward, in ``unit``.
        """
        if exact:
            return self.exact
        return self.approximate * scale if self.share else self.approximate


_LAW = (
    "engines that implement the drive law exactly solve the same equations in double precision. Rounding over 1,000 "
    "physics steps stays far below a micro-unit; larger errors indicate another law, model or integrator."
)
_FRICTION = (
    "Coulomb friction stops a body after a time and a distance that follow from the coefficient. An engine that "
    "regularizes contacts, or resolves them once in a physics step, is off by a few percent; a tenth indicates another "
    "coefficient."
)

TOLERANCES: Mapping[str, Tolerance] = {
    "frame_position": Tolerance(
        exact=1e-6,
        approximate=1e-6,
        unit="m",
        reason="kinematics is pure geometry: a larger error means that the file was misread.",
    ),
    "frame_orientation": Tolerance(
        exact=1e-6,
        approximate=1e-6,
        unit="rad",
        reason="as for positions; for an arm of 1 m, a micro-radian corresponds to a micrometer.",
    ),
    "step_response": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate drive may be off by 2 % of the step, and at the effort limits by as much as the "
        "reference itself is off due to its step size, which is measured: no engine has to be more accurate than the "
        "reference.",
    ),
    "drive_effort": Tolerance(
        exact=1e-3,
        approximate=0.1,
        unit="of the peak",
        reason="an effort is stiffness times a difference of angles, so a micro-radian is about a thousandth of the "
        "peak. An approximate drive may leave its limit two physics steps earlier or later, at which the effort "
        "changes by its whole range; beyond that, a tenth.",
    ),
    "gravity_drop": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate engine may be off by 2 % of the fall.",
    ),
    "replay_joints": Tolerance(
        exact=1e-6,
        approximate=0.05,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate drive may be off by 5 % of the largest motion of a joint. If the motion "
        "touches something, contacts determine the difference, which the certificate shows.",
    ),
    "replay_tool": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="m",
        reason="as for joints; 2 cm are acceptable for a task that requires 5 cm.",
    ),
    "episode_end": Tolerance(
        exact=0.0, approximate=0.0, unit="steps", reason="an episode that ends at another step is another episode."
    ),
    "reward": Tolerance(
        exact=1e-5,
        approximate=0.1,
        unit="per step",
        share=True,
        reason="a term may rise by 10 for each meter of the tool, so it may be off by 10 times as much as the tool; "
        "with approximate drives by a tenth of the term's range.",
    ),
    "rest_height": Tolerance(
        exact=1e-3,
        approximate=1e-3,
        unit="m",
        reason="no two engines share a contact model, and none is exact; but a body on the floor stays on the floor, "
        "except for the penetration of a soft contact under the body's weight.",
    ),
    "rest_time": Tolerance(
        exact=0.1,
        approximate=0.1,
        unit="s",
        reason="stiffness, damping and restitution of contacts depend on the engine: the time for which a body bounces "
        "may differ by two or three control steps.",
    ),
    "penetration": Tolerance(
        exact=0.01,
        approximate=0.01,
        unit="m",
        reason="a soft contact is penetrated for a few milliseconds at the impact; a tenth of the box.",
    ),
    **{
        name: Tolerance(exact=0.1, approximate=0.1, unit=unit, share=True, reason=_FRICTION)
        for name, unit in (("spin_time", "s"), ("rolling_distance", "m"), ("sliding_distance", "m"))
    },
    "bounce_height": Tolerance(
        exact=0.1,
        approximate=0.1,
        unit="m",
        share=True,
        reason="restitution depends on the stiffness and damping of the engine's contacts; a tenth of the height of "
        "the fall is visible to a task that drops objects.",
    ),
    "slip_force": Tolerance(
        exact=0.2,
        approximate=0.2,
        unit="N",
        share=True,
        reason="Coulomb friction holds until the force exceeds the coefficient times the normal forces of the fingers. "
        "Contacts also creep below this force, differently on each engine; a fifth more or less indicates another "
        "coefficient.",
    ),
    "lidar": Tolerance(
        exact=1e-3, approximate=0.02, unit="m", reason="a millimeter; the collision margins of engines are smaller."
    ),
    "success": Tolerance(
        exact=0.05,
        approximate=0.05,
        unit="of the reference's",
        reason="a policy must keep at least 95 % of its success and must not gain more than 5 % either.",
    ),
}
"""All tolerances, by the names that comparisons refer to."""

"""Every tolerance of the certificate, with its reason: the one place to change one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """How much two simulators may differ in one quantity.

    Attributes:
        exact: Where both simulators claim the capability that decides as exact.
        approximate: Where one of them claims it as approximate only.
        unit: Of both.
        share: Whether ``approximate`` is a share of how far the motion or the reward goes, instead of a number in
            ``unit``.
        reason: Why these.
    """

    exact: float
    approximate: float
    unit: str
    share: bool = False
    reason: str

    def allowed(self, exact: bool, scale: float = 1.0) -> float:
        """Return the largest error that passes.

        Args:
            exact: Whether both simulators are.
            scale: How far the motion or the reward goes, in ``unit``.
        """
        if exact:
            return self.exact
        return self.approximate * scale if self.share else self.approximate


_LAW = (
    "engines that realise the drive law exactly solve the same equations in double precision; rounding, over 1,000 "
    "physics steps, stays far below a micro-unit, and whatever is above it is another law, model or integrator."
)
_FRICTION = (
    "Coulomb friction stops a body after a time and a distance that follow from the coefficient. An engine that regularizes "
    "contacts, or resolves them once in a physics step, is a few percent off; a tenth means another coefficient."
)

TOLERANCES: Mapping[str, Tolerance] = {
    "frame_position": Tolerance(
        exact=1e-6,
        approximate=1e-6,
        unit="m",
        reason="kinematics is geometry: whoever is off by more misread the file.",
    ),
    "frame_orientation": Tolerance(
        exact=1e-6,
        approximate=1e-6,
        unit="rad",
        reason="as for positions; an arm of 1 m turns a micro-radian into a micrometre.",
    ),
    "step_response": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate drive may be off by 2 % of the step, and at the effort limits by as much as the "
        "reference's own step size puts it off, which is measured: no engine can be held to what the reference does not "
        "keep itself.",
    ),
    "drive_effort": Tolerance(
        exact=1e-3,
        approximate=0.1,
        unit="of the peak",
        reason="an effort is stiffness times a difference of angles, so a micro-radian is some thousandth of the peak. An "
        "approximate drive may leave its limit two physics steps earlier or later, at which the effort changes by its whole "
        "range; beyond that, a tenth.",
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
        reason=f"{_LAW} An approximate drive may be off by 5 % of the largest motion of a joint. Where the motion "
        "touches something, contacts decide, and the certificate shows by how much.",
    ),
    "replay_tool": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="m",
        reason="as for joints; 2 cm are within what a task that asks for 5 cm can bear.",
    ),
    "episode_end": Tolerance(
        exact=0.0, approximate=0.0, unit="steps", reason="an episode that ends elsewhere is another episode."
    ),
    "reward": Tolerance(
        exact=1e-5,
        approximate=0.1,
        unit="per step",
        share=True,
        reason="a term may rise by 10 for each metre of the tool, so it may be off by 10 times as much as the tool; with "
        "approximate drives by a tenth of the term's range.",
    ),
    "rest_height": Tolerance(
        exact=1e-3,
        approximate=1e-3,
        unit="m",
        reason="no two engines share a contact model, and none is exact; but what lies on the floor lies on the floor, "
        "within what a soft contact gives way to under the body's weight.",
    ),
    "rest_time": Tolerance(
        exact=0.1,
        approximate=0.1,
        unit="s",
        reason="stiffness, damping and restitution of contacts are the engine's own: how long a body bounces may differ by "
        "two or three control steps.",
    ),
    "penetration": Tolerance(
        exact=0.01,
        approximate=0.01,
        unit="m",
        reason="at the moment of the impact a soft contact gives way for a few milliseconds; a tenth of the box.",
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
        reason="restitution follows from the stiffness and damping of the engine's contacts; a tenth of the height of the fall "
        "is visible to a task that drops objects.",
    ),
    "slip_force": Tolerance(
        exact=0.2,
        approximate=0.2,
        unit="N",
        share=True,
        reason="Coulomb friction holds until the force exceeds the coefficient times the normal forces of the fingers. Contacts "
        "also creep below this force, differently on each engine; a fifth more or less means another coefficient.",
    ),
    "lidar": Tolerance(
        exact=1e-3, approximate=0.02, unit="m", reason="a millimetre: the collision margins of an engine are smaller."
    ),
    "success": Tolerance(
        exact=0.05,
        approximate=0.05,
        unit="of the reference's",
        reason="a policy keeps at least 95 % of its success, and does not gain more than that either.",
    ),
}
"""By the name that comparisons carry."""

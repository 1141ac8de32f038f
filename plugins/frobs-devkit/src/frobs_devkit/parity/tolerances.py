"""All tolerances used in certificates, with the reason for each. Do not define tolerances in any other module."""

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
        share: Whether ``approximate`` is a fraction of the range of the motion or reward, not in ``unit``.
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
    "engines with an exact drive law solve the same equations in double precision. Rounding errors over 1,000 physics "
    "steps stay far below 1e-6, so a larger error indicates a different drive law, model or integrator."
)
_FRICTION = (
    "the coefficient of Coulomb friction determines how long and how far a body slides, rolls or spins before it "
    "stops. An engine that regularizes contacts, or resolves them once per physics step, is off by a few percent. An "
    "error of more than 10 % indicates a different coefficient."
)

TOLERANCES: Mapping[str, Tolerance] = {
    "frame_position": Tolerance(
        exact=1e-6,
        approximate=1e-6,
        unit="m",
        reason="kinematics is pure geometry, so a larger error means that the model file was misread.",
    ),
    "frame_orientation": Tolerance(
        exact=1e-6,
        approximate=1e-6,
        unit="rad",
        reason="the tolerance matches the position tolerance: a rotation by 1e-6 rad moves the end of a 1 m arm by "
        "1e-6 m.",
    ),
    "step_response": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate drive may be off by 2 % of the step. A drive at its effort limit may also be "
        "off by the measured step-size error of the reference, because no engine is required to be more accurate than "
        "the reference.",
    ),
    "drive_effort": Tolerance(
        exact=1e-3,
        approximate=0.1,
        unit="of the peak",
        reason="a drive effort is the stiffness times an angle error, so an error of 1e-6 rad corresponds to about a "
        "thousandth of the peak effort. An approximate drive may leave saturation up to two physics steps earlier or "
        "later than the reference, so each effort is compared with all efforts of the reference within two steps. The "
        "effort may be outside the range of these efforts by 10 % of the peak.",
    ),
    "gravity_drop": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate engine may be off by 2 % of the largest joint motion.",
    ),
    "replay_joints": Tolerance(
        exact=1e-6,
        approximate=0.05,
        unit="rad or m",
        share=True,
        reason=f"{_LAW} An approximate drive may be off by 5 % of the largest motion of a joint. After the "
        "first contact, the differences depend on the contact models; the certificate lists these differences "
        "separately.",
    ),
    "replay_tool": Tolerance(
        exact=1e-6,
        approximate=0.02,
        unit="m",
        reason="the exact tolerance equals the tolerance of the joint positions. With an approximate drive, the tool "
        "may be off by 2 cm, which is acceptable for a task that requires an accuracy of 5 cm.",
    ),
    "episode_end": Tolerance(
        exact=0.0,
        approximate=0.0,
        unit="steps",
        reason="an episode that ends after a different number of steps is a different episode.",
    ),
    "reward": Tolerance(
        exact=1e-5,
        approximate=0.1,
        unit="per step",
        share=True,
        reason="a reward term may change by 10 per meter of tool motion, so it may be off by 10 times as much as the "
        "tool position. With approximate drives, the term may be off by a tenth of its range.",
    ),
    "rest_height": Tolerance(
        exact=1e-3,
        approximate=1e-3,
        unit="m",
        reason="every engine has its own contact model, and none is exact. Nevertheless, a body at rest may penetrate "
        "the floor only as far as a soft contact yields under the body's weight.",
    ),
    "rest_time": Tolerance(
        exact=0.1,
        approximate=0.1,
        unit="s",
        reason="stiffness, damping and restitution of contacts depend on the engine, so the time until a body comes "
        "to rest may differ by two or three control steps.",
    ),
    "penetration": Tolerance(
        exact=0.01,
        approximate=0.01,
        unit="m",
        reason="at impact, a body penetrates a soft contact for a few milliseconds; a tenth of the box's height is "
        "allowed.",
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
        reason="restitution depends on the stiffness and damping of the engine's contacts. An error of a tenth of the "
        "fall height would matter for a task that drops objects.",
    ),
    "slip_force": Tolerance(
        exact=0.2,
        approximate=0.2,
        unit="N",
        share=True,
        reason="with Coulomb friction, a body slips when the pulling force exceeds the friction coefficient times the "
        "sum of the fingers' normal forces. Below this force, a body may creep at a speed that depends on the engine. "
        "A difference of more than 20 % indicates a different coefficient.",
    ),
    "lidar": Tolerance(
        exact=1e-3,
        approximate=0.02,
        unit="m",
        reason="engines use collision margins of less than a millimeter, which may change the measured ranges.",
    ),
    "success": Tolerance(
        exact=0.05,
        approximate=0.05,
        unit="of the reference's",
        reason="a policy must keep at least 95 % of its success rate on the reference, and must not exceed "
        "that rate by more than 5 %.",
    ),
}
"""All tolerances, keyed by the names that comparisons use."""

"""Gains of joint drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class DriveGains:
    """Gains of the drive law: one number for all joints, or a mapping from joint names to numbers.

    Attributes:
        stiffness: Kp [N·m/rad or N/m]
        damping: Kd [N·m·s/rad or N·s/m]
    """

    stiffness: float | Mapping[str, float]
    damping: float | Mapping[str, float]

    def of(self, joint: str) -> tuple[float, float]:
        """Return (Kp, Kd) for a joint. Joints missing from a mapping have 0."""

        def pick(gain: float | Mapping[str, float]) -> float:
            return gain.get(joint, 0.0) if isinstance(gain, Mapping) else gain

        return pick(self.stiffness), pick(self.damping)

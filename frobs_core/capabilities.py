"""What a simulator can do, and what a task or controller needs of it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

from frobs_core.errors import CapabilityError, ConfigurationError


class Level(IntEnum):
    """How well a simulator does one thing. Higher levels satisfy lower needs."""

    UNSUPPORTED = 0
    APPROXIMATE = 1
    EXACT = 2

    def __str__(self) -> str:
        """Return the word that tables show."""
        return self.name.lower()


CAPABILITIES: Mapping[str, str] = {
    "determinism": "the same seed and actions give the same bits",
    "snapshot": "the complete state can be saved and restored",
    "teleport": "joint states and poses can be written",
    "pause": "time stands still between two steps",
    "batched": "many environments are stepped in one call; approximate: few, as each is an engine",
    "real_time": "steps take as long as they simulate",
    "spawn": "the scene can change while it runs",
    "drive": "the drive law of the core, at the physics rate",
    "contacts": "contacts between named bodies, over the whole control step",
    "rays": "rays and lidar",
    "wrench": "forces and torques on bodies",
    "cameras": "pictures: rgb, depth, segmentation",
    "randomize_mass": "masses per environment",
    "randomize_friction": "friction per environment",
    "randomize_gains": "drive gains per environment",
    "randomize_joint_damping": "joint damping per environment",
    "randomize_gravity": "gravity per environment",
}
"""Every capability, with what it means."""


def check_capabilities(
    simulator: str,
    has: Mapping[str, Level],
    needs: Mapping[str, Mapping[str, Level]],
) -> None:
    """Refuse a simulator that lacks what is needed, before it is built.

    Args:
        simulator: Its name.
        has: Its capabilities; one that is absent is unsupported.
        needs: For each who needs something (``"task 'reach'"``): capability to lowest level.

    Raises:
        CapabilityError: Something is missing; the message holds a table of all that is.
        ConfigurationError: A need names no known capability.
    """
    missing = []
    for who, wanted in needs.items():
        for capability, level in wanted.items():
            if capability not in CAPABILITIES:
                known = ", ".join(CAPABILITIES)
                raise ConfigurationError(f"{who} needs '{capability}', which is no capability. Known: {known}.")
            there_is = has.get(capability, Level.UNSUPPORTED)
            if there_is < level:
                missing.append((who, capability, str(level), str(there_is)))
    if missing:
        raise CapabilityError(simulator, missing)

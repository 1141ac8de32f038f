"""Capabilities of simulators, and the check of what tasks and controllers require."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, cast

from frobs_core.errors import CapabilityError, ConfigurationError

if TYPE_CHECKING:
    from frobs_core.specs import AbilityRecord


class Level(IntEnum):
    """How well a simulator supports a capability. Higher levels satisfy lower requirements."""

    UNSUPPORTED = 0
    APPROXIMATE = 1
    EXACT = 2

    def __str__(self) -> str:
        """Return the word that is shown in tables."""
        return self.name.lower()


CAPABILITIES: Mapping[str, str] = {
    "determinism": "the same seed and actions give bit-identical results",
    "snapshot": "the complete state can be saved and restored",
    "teleport": "joint states and poses can be written",
    "pause": "time does not pass between two steps",
    "batched": "many environments are stepped in one call; approximate: only a few, because each is a separate engine",
    "real_time": "the world runs by itself and a step waits for it (a paced simulator)",
    "spawn": "the scene can change while it runs",
    "drive": "the drive law of the core, at the physics rate",
    "contacts": "contacts between named bodies, over the whole control step",
    "rays": "rays and lidar",
    "wrench": "forces and torques on bodies",
    "force_torque": "force-torque sensors in joints of robots",
    "attachments": "bodies and links that are fixed to each other",
    "cameras": "pictures: rgb, depth, segmentation",
    "randomize_mass": "masses per environment",
    "randomize_friction": "friction per environment",
    "randomize_size": "sizes of scene bodies per environment",
    "randomize_gains": "drive gains per environment",
    "randomize_joint_damping": "joint damping per environment",
    "randomize_gravity": "gravity per environment",
}
"""All abilities of the core with their meanings; see :func:`abilities` for those of plugins."""


METHODS: Mapping[str, Sequence[str]] = {
    "rays": ("rays",),
    "wrench": ("apply_wrench",),
    "cameras": ("render",),
}
"""Methods of :class:`frobs_core.interfaces.Simulation` that a simulator with an ability implements."""


def abilities() -> Mapping[str, AbilityRecord]:
    """Return all abilities by name: those of the core, and those of plugins.

    If an ability of a plugin has the same name as one of the core, it is listed as ``"distribution:name"``.
    """
    from frobs_core import plugins  # imported here because it reads records, which use levels
    from frobs_core.specs import AbilityRecord

    found = {
        name: AbilityRecord(name=name, summary=summary, methods=tuple(METHODS.get(name, ())))
        for name, summary in CAPABILITIES.items()
    }
    for name, record in plugins.records("ability").items():
        clashes = name in CAPABILITIES
        key = f"{plugins.get_report('ability', name).distribution}:{name}" if clashes else name
        found[key] = cast("AbilityRecord", record)
    return found


def check_capabilities(
    simulator: str,
    has: Mapping[str, Level],
    needs: Mapping[str, Mapping[str, Level]],
) -> None:
    """Check that a simulator supports all required capabilities, before it is built.

    Args:
        simulator: Name of the simulator.
        has: Its capabilities; missing ones are unsupported.
        needs: For each owner of a need (``"task 'reach'"``): minimum level by capability.

    Raises:
        CapabilityError: A requirement is not met; the message contains a table of all such requirements.
        ConfigurationError: A need refers to an unknown capability.
    """
    missing = []
    for who, wanted in needs.items():
        for capability, level in wanted.items():
            if capability not in CAPABILITIES and capability not in abilities():
                known = ", ".join(abilities())
                raise ConfigurationError(
                    f"{who} needs '{capability}', which is not a known capability. Known: {known}."
                )
            there_is = has.get(capability, Level.UNSUPPORTED)
            if there_is < level:
                missing.append((who, capability, str(level), str(there_is)))
    if missing:
        raise CapabilityError(simulator, missing)

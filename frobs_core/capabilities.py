"""What a simulator can do, and what a task or controller needs of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, cast

from frobs_core.errors import CapabilityError, ConfigurationError

if TYPE_CHECKING:
    from frobs_core.specs import AbilityRecord


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
    "real_time": "the world moves on by itself, and a step waits for it: a paced simulator",
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
"""Every ability of the core, with what it means; see :func:`abilities` for those of plugins."""


METHODS: Mapping[str, Sequence[str]] = {
    "rays": ("rays",),
    "wrench": ("apply_wrench",),
    "cameras": ("render",),
}
"""Methods of :class:`frobs_core.interfaces.Simulation` that a simulator with an ability defines."""


def abilities() -> Mapping[str, AbilityRecord]:
    """Return all abilities by name: those of the core, and those of plugins.

    An ability of a plugin that has the name of one of the core is ``"distribution:name"``.
    """
    from frobs_core import plugins  # which reads records, which have levels
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
            if capability not in CAPABILITIES and capability not in abilities():
                known = ", ".join(abilities())
                raise ConfigurationError(f"{who} needs '{capability}', which is no capability. Known: {known}.")
            there_is = has.get(capability, Level.UNSUPPORTED)
            if there_is < level:
                missing.append((who, capability, str(level), str(there_is)))
    if missing:
        raise CapabilityError(simulator, missing)

"""Capabilities of simulators, and a check that a simulator supports all capabilities that an environment requires."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from frobs_core import plugins
from frobs_core.plugins.records import CapabilityRecord, Level
from frobs_core.util.errors import CapabilityError, ConfigurationError

CAPABILITIES: Mapping[str, str] = {
    "determinism": "the same seed and actions give bit-identical results",
    "snapshot": "the complete state can be saved and restored",
    "teleport": "joint states and poses can be written",
    "pause": "simulated time advances only during a step",
    "batched": "one call steps many environments (at level approximate: only a few, each in its own engine instance)",
    "real_time": "the simulation runs continuously, and each step waits for one control timestep (a paced simulator)",
    "spawn": "the scene can change while the simulation runs",
    "drive": "joint drives follow the core's drive law at the physics rate",
    "contacts": "contacts between named bodies are detected over the whole control step",
    "rays": "rays and lidar",
    "wrench": "forces and torques on bodies",
    "force_torque": "force-torque sensors in robot joints",
    "attachments": "bodies and links can be attached to each other",
    "cameras": "images: rgb, depth, segmentation",
    "camera_intrinsics": "cameras with the focal length and principal point of a real camera",
    "randomize_mass": "masses per environment",
    "randomize_friction": "friction per environment",
    "randomize_size": "scene body sizes per environment",
    "randomize_gains": "drive gains per environment",
    "randomize_joint_damping": "joint damping per environment",
    "randomize_gravity": "gravity per environment",
    "randomize_looks": "colors and light per environment",
    "randomize_cameras": "camera poses and fields of view per environment",
    "randomize_scenery": "patterns of the floor, and distractors, per environment",
}
"""Descriptions of the core capabilities, by name. :func:`known_capabilities` also includes those of plugins."""


METHODS: Mapping[str, Sequence[str]] = {"rays": ("rays",), "wrench": ("apply_wrench",), "cameras": ("render",)}
"""Methods of :class:`frobs_core.contracts.Simulation` that a simulator must implement, by capability."""


def known_capabilities() -> Mapping[str, CapabilityRecord]:
    """Return the capabilities of the core and of all plugins, by name.

    A plugin capability with the same name as a core capability is listed as ``"distribution:name"``.
    """
    found = {
        name: CapabilityRecord(name=name, summary=summary, methods=tuple(METHODS.get(name, ())))
        for name, summary in CAPABILITIES.items()
    }
    for name, record in plugins.records(CapabilityRecord).items():
        clashes = name in CAPABILITIES
        key = f"{plugins.get_report('capability', name).distribution}:{name}" if clashes else name
        found[key] = record
    return found


def check_capabilities(simulator: str, has: Mapping[str, Level], needs: Mapping[str, Mapping[str, Level]]) -> None:
    """Check that a simulator supports all required capabilities.

    The check does not require a simulation, so it can run before the simulation is built.

    Args:
        simulator: Name of the simulator.
        has: Support level of each capability. Omitted capabilities are unsupported.
        needs: Minimum level of each capability, for each task or controller, for example ``{"task 'reach'":
            {"snapshot": Level.EXACT}}``.

    Raises:
        CapabilityError: A requirement is not met. The error message contains a table of all unmet requirements.
        ConfigurationError: A requirement names an unknown capability.
    """
    missing = []
    for who, wanted in needs.items():
        for capability, level in wanted.items():
            if capability not in CAPABILITIES and capability not in known_capabilities():
                known = ", ".join(known_capabilities())
                raise ConfigurationError(
                    f"{who} needs '{capability}', which is not a known capability. Known: {known}."
                )
            there_is = has.get(capability, Level.UNSUPPORTED)
            if there_is < level:
                missing.append((who, capability, str(level), str(there_is)))
    if missing:
        raise CapabilityError(simulator, missing)

"""Checks of a simulator, with small robots and scenes of the kit."""

from __future__ import annotations

from frobs_core import plugins
from frobs_core.specs import SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_of, collect
from frobs_devkit.testing.simulator import (
    bodies,
    contacts,
    contract,
    drive,
    forces,
    kinematics,
    model_files,
    pacing,
    parameters,
    pictures,
    running,
    state,
    world,
)
from frobs_devkit.testing.simulator.subject import SimulatorUnderTest

CHECKS = checks_of(
    contract,
    kinematics,
    model_files,
    drive,
    running,
    pacing,
    state,
    world,
    bodies,
    contacts,
    forces,
    pictures,
    parameters,
)
"""All checks of a simulator, in the order in which they run."""


def check_simulator(simulator: str | SimulatorRecord) -> list[Check]:
    """Return the checks of a simulator.

    Capabilities that the record claims are checked: almost to machine precision if it claims ``exact``, within a few
    percent if it claims ``approximate``. :attr:`Report.verified_capabilities` lists those that were verified.

    Args:
        simulator: Name of the simulator, or a record that is not installed yet.

    Raises:
        UnknownNameError: The simulator does not exist.
    """
    record = plugins.get_record("simulator", simulator) if isinstance(simulator, str) else simulator
    assert isinstance(record, SimulatorRecord)
    return collect(SimulatorUnderTest(record), CHECKS)

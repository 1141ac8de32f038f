"""Checks of a simulator, on small robots and scenes of the kit's own."""

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
"""Every check of a simulator, in the order in which they run."""


def check_simulator(simulator: str | SimulatorRecord) -> list[Check]:
    """Return the checks of a simulator.

    A capability is checked where the record claims it: to the last digits where it claims ``exact``, within a few
    percent where it claims ``approximate``. :attr:`Report.verified_capabilities` says which of them held.

    Args:
        simulator: Its name, or a record that is not installed yet.

    Raises:
        UnknownNameError: No simulator has this name.
    """
    record = plugins.get_record("simulator", simulator) if isinstance(simulator, str) else simulator
    assert isinstance(record, SimulatorRecord)
    return collect(SimulatorUnderTest(record), CHECKS)

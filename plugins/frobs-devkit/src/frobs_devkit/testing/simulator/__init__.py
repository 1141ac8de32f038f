"""Conformance checks for a simulator, with small robots and scenes from the kit."""

from __future__ import annotations

from frobs_core.kernel.robot_config import find_record
from frobs_core.plugins.records import SimulatorRecord
from frobs_devkit.testing.checks import Check, checks_in, collect
from frobs_devkit.testing.simulator.under_test import SimulatorUnderTest

CHECKS = checks_in(
    __name__,
    "contract kinematics model_files drive dynamics stepping pacing world bodies contacts forces rendering parameters",
)
"""All simulator checks, in the order in which they run."""


def check_simulator(simulator: str | SimulatorRecord) -> list[Check]:
    """Return the conformance checks for a simulator.

    The checks cover all capabilities that the record claims. The tolerance is close to machine precision for the level
    ``exact``, and a few percent for the level ``approximate``. :attr:`Report.verified_capabilities` lists the
    capabilities that the checks have verified.

    Args:
        simulator: Name of an installed simulator, or the record of a simulator that is not installed yet.

    Raises:
        UnknownNameError: The simulator does not exist.
    """
    return collect(SimulatorUnderTest(find_record(SimulatorRecord, simulator)), CHECKS)

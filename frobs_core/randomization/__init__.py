"""Domain randomization: random differences between environments and episodes, defined by settings."""

from frobs_core.randomization.randomization import Randomization
from frobs_core.randomization.settings import Setting, Settings, physical_parameters, read_settings
from frobs_core.randomization.targets import Unit, find_units

__all__ = [
    "Randomization",
    "Setting",
    "Settings",
    "Unit",
    "find_units",
    "physical_parameters",
    "read_settings",
]

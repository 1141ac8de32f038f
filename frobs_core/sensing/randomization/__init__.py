"""Domain randomization, which varies physics, observations and delays between environments and episodes."""

from frobs_core.sensing.randomization.draw import Setting
from frobs_core.sensing.randomization.randomization import Randomization
from frobs_core.sensing.randomization.settings import Settings, physical_parameters, read_settings
from frobs_core.sensing.randomization.targets import Unit, find_units

__all__ = ["Randomization", "Setting", "Settings", "Unit", "find_units", "physical_parameters", "read_settings"]

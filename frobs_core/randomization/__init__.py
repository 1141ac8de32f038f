"""Domain randomisation: what differs between environments and episodes, as data on the environment."""

from frobs_core.randomization.randomization import Randomization
from frobs_core.randomization.settings import CAPABILITY, PARAMETERS, Settings, read_settings

__all__ = ["CAPABILITY", "PARAMETERS", "Randomization", "Settings", "read_settings"]

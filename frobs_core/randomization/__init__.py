"""Domain randomisation: what differs between environments and episodes, as data on the environment."""

from frobs_core.randomization.observation import Term, find_terms
from frobs_core.randomization.randomization import Randomization
from frobs_core.randomization.settings import CAPABILITY, PARAMETERS, Setting, Settings, read_settings
from frobs_core.randomization.targets import Unit, find_units

__all__ = [
    "CAPABILITY",
    "PARAMETERS",
    "Randomization",
    "Setting",
    "Settings",
    "Term",
    "Unit",
    "find_terms",
    "find_units",
    "read_settings",
]

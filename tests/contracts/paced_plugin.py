"""A plugin that offers the paced simulator of the templates."""

import sys
from pathlib import Path

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import SimulatorRecord

sys.path.insert(0, str(Path(__file__).parents[2] / "templates"))
try:
    from my_paced_simulator import RECORD
finally:
    sys.path.pop(0)


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    return [RECORD]

"""After a reset, the time includes the time that the robots took to drive home."""

from __future__ import annotations

from frobs_core.util.arrays import Mask
from templates.my_paced_simulator import MyPacedSimulator

EXACT, APPROXIMATE = "", "real_time drive"


class Faulty(MyPacedSimulator):
    def reset(self, mask: Mask | None = None) -> None:
        if mask is None or mask.any():
            self._drive_home()

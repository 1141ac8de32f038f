"""Of a command with a row for each physics step, only the last row is sent to the world."""

from __future__ import annotations

from templates.my_paced_simulator import MyPacedSimulator, PacedRobot

EXACT, APPROXIMATE = "", "real_time drive"


class _Robot(PacedRobot):
    def command(self, values):
        self._rows_given = values.shape[1] if values.ndim == 3 else None
        self._ask("command", self.name, values[0, -1:] if values.ndim == 3 else values)


class Faulty(MyPacedSimulator):
    def __init__(self, robots, scene, **options):
        super().__init__(robots, scene, **options)
        for robot in self._robots.values():
            robot.__class__ = _Robot

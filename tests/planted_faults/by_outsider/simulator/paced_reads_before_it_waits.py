"""A paced simulator reads the world before it waits for the end of the step: its state is one control step old."""

from __future__ import annotations

from templates import my_paced_simulator

EXACT = ""
APPROXIMATE = "real_time drive"


class Faulty(my_paced_simulator.MyPacedSimulator):
    def step(self, decimation):
        for robot in self._robots.values():
            robot.check_rows(decimation)
        self._read()
        self._pacer.wait(decimation * self.physics_timestep)

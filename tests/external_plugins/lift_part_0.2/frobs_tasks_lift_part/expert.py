"""The expert for the dumbbell."""

import numpy as np

from frobs_tasks_lift_part.task import LiftPart
from frobs_tasks_manipulation.experts.tool_expert import ToolExpert

ABOVE, DOWN, CLOSE, LIFT = range(4)


class LiftPartExpert(ToolExpert[LiftPart]):
    """Goes above the dumbbell, goes down, closes the fingers and lifts."""

    def _next_phase(self):
        task, phase = self.task, self.phase
        aside = np.hypot(*(task.part.pos - task.tcp)[:, :2].T)
        return np.select(
            [
                (phase == ABOVE) & (aside < 0.008),
                (phase == DOWN) & (task.to_part < 0.008),
                (phase == CLOSE) & (self.age >= 8) & (self.finger_speed < 0.005),
            ],
            [DOWN, CLOSE, LIFT],
            phase,
        )

    def _aim(self):
        task, phase = self.task, self.phase[:, None]
        above, lifted = task.part.pos.copy(), task.tcp.copy()
        above[:, 2], lifted[:, 2] = 0.1, 0.18
        place = np.select([phase == ABOVE, phase == LIFT], [above, lifted], task.part.pos)
        return place, np.where(self.phase <= DOWN, 1.0, 0.0)

"""In the step in which a waypoint is reached, the progress compares the distance to it with the distance to the following waypoint."""

from __future__ import annotations

from frobs_tasks_navigation.navigate import Navigate


class Faulty(Navigate):
    def advance(self, context):
        before = self._distance
        super().advance(context)
        self.last_step.progress = before - self._distance

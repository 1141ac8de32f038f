"""A reset of some environments forgets the smoothed action of all of them."""

from __future__ import annotations

from templates.my_controller import MyController


class Faulty(MyController):
    def reset(self, mask):
        super().reset(mask)
        self._smooth[:] = 0.0

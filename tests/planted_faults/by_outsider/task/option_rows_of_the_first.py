"""A goal that is given for some environments is taken from the first rows of the option, not from those of the mask."""

from __future__ import annotations

from templates.my_reach import MyReach


class Faulty(MyReach):
    def reset(self, mask, rng, options):
        super().reset(mask, rng, options)
        if "goal" in options:
            rows = slice(None) if mask is None else mask
            self._goal[rows] = options["goal"][: len(self._goal[rows])]
            self._measure()

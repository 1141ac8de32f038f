"""The automatic target entropy is plus the number of action components instead of minus it, so the entropy's weight never stops growing."""

from __future__ import annotations

import numpy as np

from frobs_algos_sb3.sac import SAC


class Faulty(SAC):
    def _model_kwargs(self):
        kwargs = super()._model_kwargs()
        if kwargs["target_entropy"] == "auto":
            kwargs["target_entropy"] = float(np.prod(self.action_space.shape))
        return kwargs

"""Contacts are copied out before the engine steps: they are those of the control step before."""

from __future__ import annotations

from frobs_sim_mujoco.simulation import MujocoSimulation

EXACT = "determinism snapshot teleport pause batched drive contacts rays wrench force_torque attachments cameras"
APPROXIMATE = ""


class Faulty(MujocoSimulation):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self._late = self.contacts.snapshot()

    def reset(self, mask=None):
        super().reset(mask)
        for array in self._late.values():
            array[slice(None) if mask is None else mask] = 0

    def step(self, decimation):
        super().step(decimation)
        now = self.contacts.snapshot()
        self.contacts.restore(self._late)
        self._late = now

    def snapshot(self):
        return {**super().snapshot(), **{f"late/{name}": array.copy() for name, array in self._late.items()}}

    def restore(self, snapshot):
        super().restore(snapshot)
        self._late = {name: snapshot[f"late/{name}"].copy() for name in self._late}

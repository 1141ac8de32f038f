"""The setting ``gamma`` is accepted, checked and stored, and the model never gets it."""

from __future__ import annotations

from frobs_algos_sb3.ppo import PPO


class Faulty(PPO):
    def _make_model(self, policy, **options):
        options.pop("gamma")
        return super()._make_model(policy, **options)

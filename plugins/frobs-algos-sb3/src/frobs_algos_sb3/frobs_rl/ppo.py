"""Proximal policy optimization."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.on_policy import OnPolicyModel


class PPO(OnPolicyModel):
    """Proximal policy optimization; its YAML file has the block ``ppo_params``."""

    algorithm: ClassVar[str] = "ppo"

"""Deep deterministic policy gradient."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.basic_model import BasicModel


class DDPG(BasicModel):
    """Deep deterministic policy gradient; its YAML file has the block ``ddpg_params``."""

    algorithm: ClassVar[str] = "ddpg"

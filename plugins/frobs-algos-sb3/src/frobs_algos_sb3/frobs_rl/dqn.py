"""Deep Q network."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.basic_model import BasicModel


class DQN(BasicModel):
    """Deep Q network; its YAML file has the block ``dqn_params``."""

    algorithm: ClassVar[str] = "dqn"

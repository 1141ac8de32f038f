"""Twin delayed DDPG."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.basic_model import BasicModel


class TD3(BasicModel):
    """Twin delayed DDPG; its YAML file has the block ``td3_params``."""

    algorithm: ClassVar[str] = "td3"

"""Soft actor-critic."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.basic_model import BasicModel


class SAC(BasicModel):
    """Soft actor-critic; its YAML file has the block ``sac_params``."""

    algorithm: ClassVar[str] = "sac"

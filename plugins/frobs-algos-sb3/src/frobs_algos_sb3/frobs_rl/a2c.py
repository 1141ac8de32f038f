"""Advantage actor-critic."""

from __future__ import annotations

from typing import ClassVar

from frobs_algos_sb3.frobs_rl.on_policy import OnPolicyModel


class A2C(OnPolicyModel):
    """Advantage actor-critic; its YAML file has the block ``a2c_params``."""

    algorithm: ClassVar[str] = "a2c"

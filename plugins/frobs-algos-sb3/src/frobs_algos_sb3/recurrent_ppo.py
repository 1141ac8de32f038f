"""Proximal policy optimization with recurrent networks."""

from __future__ import annotations

from typing import Annotated, Any, Self

import sb3_contrib
from pydantic import Field, PositiveInt, model_validator

from frobs_algos_sb3.networks import RecurrentActorCriticConfig
from frobs_algos_sb3.ppo import PPO, PPOConfig


class RecurrentPPOConfig(PPOConfig):
    """Settings of recurrent PPO, with the defaults of sb3-contrib."""

    n_steps: PositiveInt = 128
    batch_size: Annotated[int, Field(ge=2)] = 128
    policy_kwargs: RecurrentActorCriticConfig = RecurrentActorCriticConfig()

    @model_validator(mode="after")
    def _check_policy(self) -> Self:
        if self.initial_policy is not None:
            raise ValueError("recurrent_ppo does not support initial_policy; use ppo or a2c")
        return self


class RecurrentPPO(PPO):
    """PPO with recurrent layers. Pass the recurrent state and the episode starts to ``predict``."""

    name = "recurrent_ppo"
    config_model = RecurrentPPOConfig
    model_class = sb3_contrib.RecurrentPPO

    def _make_model(self, policy: str, **kwargs: Any) -> Any:
        return super()._make_model(policy.replace("Policy", "LstmPolicy"), **kwargs)

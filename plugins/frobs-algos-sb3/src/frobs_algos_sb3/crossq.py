"""CrossQ, which uses batch normalization instead of target networks."""

from __future__ import annotations

from typing import Any

import sb3_contrib
from pydantic import PositiveInt

from frobs_algos.settings import Schedule
from frobs_algos_sb3.networks import BatchNormConfig
from frobs_algos_sb3.noise import ActionNoiseConfig
from frobs_algos_sb3.off_policy import OffPolicy, OffPolicyConfig
from frobs_algos_sb3.sac import EntropyConfig
from frobs_core.util.errors import IncompatibleSpaceError


class CrossQConfig(EntropyConfig, OffPolicyConfig):
    """Settings of CrossQ, with the defaults of sb3-contrib.

    Attributes:
        policy_delay: Number of critic gradient steps per actor gradient step.
        action_noise: Noise that is added to actions during data collection, or None for no noise.
        policy_kwargs: Settings of the networks.
    """

    learning_rate: Schedule = 1e-3
    policy_delay: PositiveInt = 3
    action_noise: ActionNoiseConfig | None = None
    policy_kwargs: BatchNormConfig = BatchNormConfig()


class CrossQ(OffPolicy):
    """CrossQ (Bhatt et al. 2024)."""

    name = "crossq"
    config_model = CrossQConfig
    model_class = sb3_contrib.CrossQ

    def _make_model(self, policy: str, **kwargs: Any) -> Any:
        if policy != "MlpPolicy":
            raise IncompatibleSpaceError(
                "algorithm 'crossq'",
                self.observation_space,
                f"requires observations in a flat Box, but the observation space is {self.observation_space}; "
                "flatten them with gymnasium.wrappers.FlattenObservation, or choose another algorithm.",
            )
        return super()._make_model(policy, **kwargs)

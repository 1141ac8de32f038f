"""Deep deterministic policy gradient."""

from __future__ import annotations

import stable_baselines3 as sb3

from frobs_algos.settings import Schedule
from frobs_algos_sb3.networks import DeterministicConfig
from frobs_algos_sb3.off_policy import ContinuousConfig, OffPolicy


class DDPGConfig(ContinuousConfig):
    """Settings of DDPG, with the defaults of stable-baselines3."""

    learning_rate: Schedule = 1e-3
    policy_kwargs: DeterministicConfig = DeterministicConfig(n_critics=1)


class DDPG(OffPolicy):
    """Deep deterministic policy gradient (Lillicrap et al. 2015)."""

    name = "ddpg"
    config_model = DDPGConfig
    model_class = sb3.DDPG

"""Deep Q network."""

from __future__ import annotations

import stable_baselines3 as sb3
from pydantic import PositiveFloat, PositiveInt

from frobs_algos.settings import Fraction, Schedule
from frobs_algos_sb3.networks import QNetworkConfig
from frobs_algos_sb3.off_policy import OffPolicy, OffPolicyConfig, TrainFrequency


class DQNConfig(OffPolicyConfig):
    """Settings of DQN, with the defaults of stable-baselines3.

    Attributes:
        tau: Interpolation factor for updates of the target network, where 1 copies the new weights.
        target_update_interval: Number of steps, over all environments, between updates of the target network.
        exploration_fraction: Fraction of the training steps during which the probability of random actions decreases.
        exploration_initial_eps: Probability of a random action at the start of training.
        exploration_final_eps: Final probability of a random action.
        max_grad_norm: Maximum norm of the gradients.
        policy_kwargs: Settings of the network.
    """

    learning_rate: Schedule = 1e-4
    batch_size: PositiveInt = 32
    tau: Fraction = 1.0
    train_freq: PositiveInt | TrainFrequency = 4
    target_update_interval: PositiveInt = 10_000
    exploration_fraction: Fraction = 0.1
    exploration_initial_eps: Fraction = 1.0
    exploration_final_eps: Fraction = 0.05
    max_grad_norm: PositiveFloat = 10.0
    policy_kwargs: QNetworkConfig = QNetworkConfig()


class DQN(OffPolicy):
    """Deep Q network (Mnih et al. 2015)."""

    name = "dqn"
    config_model = DQNConfig
    model_class = sb3.DQN

"""RLlib's soft actor-critic."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

import torch as th
from pydantic import Field, NonNegativeInt, PositiveInt, model_validator
from ray.rllib.algorithms import sac
from ray.rllib.algorithms.sac.torch.sac_torch_learner import SACTorchLearner
from ray.rllib.core import DEFAULT_MODULE_ID
from ray.rllib.policy.sample_batch import MultiAgentBatch, SampleBatch

from frobs_algos.settings import EntropyCoefficient, Fraction
from frobs_ray.rllib.algorithm import RLlibAlgorithm
from frobs_ray.rllib.config import NetworkConfig, RLlibConfig
from frobs_ray.rllib.networks import SoftActorCritic
from frobs_ray.rllib.replay import ReplayBuffer, Transitions


class SACConfig(RLlibConfig):
    """Settings of SAC. The defaults match those of ``frobs-algos-sb3``.

    RLlib uses the Huber loss as its value loss, instead of the mean squared error.

    Attributes:
        buffer_size: Maximum number of steps in the replay buffer, counted over all environments.
        learning_starts: Number of steps with random actions before learning starts, counted over all environments. When
            training is resumed, this number of steps is collected with the policy instead.
        batch_size: Number of control steps in the batch of each gradient step.
        train_freq: Number of control steps in every environment between two rounds of learning.
        gradient_steps: Number of gradient steps per round of learning, or −1 for one gradient step per collected
            control step.
        tau: Soft update coefficient of the target networks, where 1 copies the current weights.
        ent_coef: Positive weight of the entropy. ``auto`` learns the weight, starting from 1, and ``auto_0.1`` learns
            the weight, starting from 0.1.
        target_entropy: Target entropy for a learned weight. ``auto`` sets the target to minus the number of action
            components.
        policy_kwargs: Settings of the networks.
    """

    buffer_size: PositiveInt = 1_000_000
    learning_starts: NonNegativeInt = 100
    batch_size: PositiveInt = 256
    train_freq: PositiveInt = 1
    gradient_steps: Annotated[int, Field(ge=-1)] = 1
    tau: Fraction = 0.005
    ent_coef: EntropyCoefficient = "auto"
    target_entropy: float | Literal["auto"] = "auto"
    policy_kwargs: NetworkConfig = NetworkConfig()

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.ent_coef == 0.0:
            raise ValueError("ent_coef must be positive, because RLlib stores its logarithm")
        if self.gradient_steps == 0:
            raise ValueError("gradient_steps must be positive or -1")
        return self

    def temperature(self) -> float:
        """Return the initial weight of the entropy."""
        if isinstance(self.ent_coef, str):
            return float(self.ent_coef.removeprefix("auto").removeprefix("_") or 1.0)
        return self.ent_coef


class _Learner(SACTorchLearner):
    """RLlib's SAC learner for batches that consist of arrays."""

    def _make_batch_if_necessary(self, training_data: Any) -> MultiAgentBatch:
        transitions: Transitions = training_data.episodes[0]
        tensors = {name: th.from_numpy(values) for name, values in transitions.items()}
        return MultiAgentBatch({DEFAULT_MODULE_ID: SampleBatch(tensors)}, env_steps=len(transitions))


class _SAC(sac.SAC):
    """RLlib's SAC algorithm with a replay buffer of arrays."""

    def _create_local_replay_buffer_if_necessary(self, config: Any) -> Any:
        return ReplayBuffer(config.replay_buffer_config["capacity"], config.env_config["seed"])


class RLlibSAC(RLlibAlgorithm):
    """Soft actor-critic (Haarnoja et al. 2018)."""

    name: ClassVar[str] = "rllib_sac"
    config_model: ClassVar[type[RLlibConfig]] = SACConfig
    module_class: ClassVar[type[Any]] = SoftActorCritic
    has_target_networks: ClassVar[bool] = True
    _config: SACConfig

    def rllib_config(self, steps: int) -> sac.SACConfig:
        settings = self._config
        rates: Any = settings.rates(self.steps, steps)
        collected = settings.train_freq * self.env.num_envs
        updates = collected if settings.gradient_steps < 0 else settings.gradient_steps
        runners = settings.num_env_runners
        # RLlib measures the training intensity relative to the steps that all runners sample per round, but counts one
        # runner too many.
        counted = settings.train_freq * (self.env.num_envs // max(runners, 1)) * (runners + 1)
        config = sac.SACConfig(algo_class=_SAC)
        config.training(
            actor_lr=rates,
            critic_lr=rates,
            alpha_lr=rates if isinstance(settings.ent_coef, str) else 0.0,
            gamma=settings.gamma,
            tau=settings.tau,
            initial_alpha=settings.temperature(),
            target_entropy=settings.target_entropy,
            twin_q=True,
            n_step=1,
            train_batch_size_per_learner=settings.batch_size,
            training_intensity=updates * settings.batch_size / counted,
            num_steps_sampled_before_learning_starts=max(settings.learning_starts, 1),
            replay_buffer_config={"type": "EpisodeReplayBuffer", "capacity": settings.buffer_size},
            learner_class=_Learner,
        )
        config.env_runners(rollout_fragment_length=settings.train_freq)
        config.reporting(min_sample_timesteps_per_iteration=max(collected, _STEPS))
        return config


_STEPS = 64
"""Minimum number of environment steps per iteration, chosen to keep the fixed overhead of iterations small."""

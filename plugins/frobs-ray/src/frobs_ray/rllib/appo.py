"""RLlib's asynchronous proximal policy optimization."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import NonNegativeFloat, PositiveFloat, PositiveInt
from ray.rllib.algorithms import appo

from frobs_algos.settings import Fraction, Schedule
from frobs_ray.rllib.actor_critic import ActorCritic
from frobs_ray.rllib.algorithm import RLlibAlgorithm
from frobs_ray.rllib.config import OnPolicyConfig, RLlibConfig


class APPOConfig(OnPolicyConfig):
    """Settings of APPO. The defaults match those of RLlib.

    Attributes:
        batch_size: Number of control steps in the batch of each gradient step, rounded up to a multiple of ``n_steps``
            times the number of environments per runner.
        tau: Soft update coefficient of the target network, where 1 copies the current weights.
        target_update_interval: Number of times that the whole buffer is refilled between two updates of the target
            network.
        buffer_batches: Number of batches that the buffer stores for further gradient steps.
        buffer_passes: Number of times that each batch is used.
    """

    learning_rate: Schedule = 5e-4
    n_steps: PositiveInt = 50
    clip_range: PositiveFloat = 0.4
    ent_coef: NonNegativeFloat = 0.01
    max_grad_norm: PositiveFloat = 40.0
    batch_size: PositiveInt = 500
    tau: Fraction = 1.0
    target_update_interval: PositiveInt = 2
    buffer_batches: PositiveInt = 8
    buffer_passes: PositiveInt = 2


class RLlibAPPO(RLlibAlgorithm):
    """Asynchronous PPO (Luo et al. 2020), which trains while the environments run."""

    name: ClassVar[str] = "rllib_appo"
    config_model: ClassVar[type[RLlibConfig]] = APPOConfig
    module_class: ClassVar[type[Any]] = ActorCritic
    has_target_networks: ClassVar[bool] = True

    def rllib_config(self, steps: int) -> appo.APPOConfig:
        """Return RLlib's configuration."""
        settings: Any = self.settings
        assert isinstance(settings, APPOConfig)
        config = appo.APPOConfig()
        config.training(
            lr=settings.rates(self.steps, steps),
            gamma=settings.gamma,
            train_batch_size_per_learner=settings.batch_size,
            clip_param=settings.clip_range,
            entropy_coeff=settings.ent_coef,
            vf_loss_coeff=settings.vf_coef,
            grad_clip=settings.max_grad_norm,
            grad_clip_by="global_norm",
            tau=settings.tau,
            target_network_update_freq=settings.target_update_interval,
            circular_buffer_num_batches=settings.buffer_batches,
            circular_buffer_iterations_per_batch=settings.buffer_passes,
        )
        config.env_runners(rollout_fragment_length=settings.n_steps)
        return config

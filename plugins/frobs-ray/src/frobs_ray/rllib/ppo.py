"""RLlib's proximal policy optimization."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt
from ray.rllib.algorithms import ppo

from frobs_algos.settings import Fraction
from frobs_ray.rllib.actor_critic import ActorCritic
from frobs_ray.rllib.algorithm import RLlibAlgorithm
from frobs_ray.rllib.config import OnPolicyConfig, RLlibConfig


class PPOConfig(OnPolicyConfig):
    """Settings of PPO. The defaults match those of ``frobs-algos-sb3``.

    RLlib normalizes advantages over a whole iteration instead of over each batch, and never stops an iteration early.

    Attributes:
        gae_lambda: Trade-off between one-step advantages (0) and full returns (1).
        batch_size: Number of control steps in the minibatch of each gradient step.
        n_epochs: Number of passes over the steps of an iteration.
        kl_coeff: Initial weight of the KL divergence penalty in the loss, or 0 for no penalty.
        kl_target: Target KL divergence, which controls the adaptation of the penalty weight.
    """

    gae_lambda: Fraction = 0.95
    batch_size: Annotated[int, Field(ge=2)] = 64
    n_epochs: PositiveInt = 10
    kl_coeff: NonNegativeFloat = 0.0
    kl_target: PositiveFloat = 0.01


class RLlibPPO(RLlibAlgorithm):
    """Proximal policy optimization (Schulman et al. 2017)."""

    name: ClassVar[str] = "rllib_ppo"
    config_model: ClassVar[type[RLlibConfig]] = PPOConfig
    module_class: ClassVar[type[Any]] = ActorCritic

    def rllib_config(self, steps: int) -> ppo.PPOConfig:
        """Return RLlib's configuration."""
        settings: Any = self.settings
        assert isinstance(settings, PPOConfig)
        assert self.env is not None
        batch = settings.n_steps * self.env.num_envs
        config = ppo.PPOConfig()
        config.training(
            lr=settings.rates(self.steps, steps),
            gamma=settings.gamma,
            lambda_=settings.gae_lambda,
            train_batch_size_per_learner=batch,
            minibatch_size=min(settings.batch_size, batch),
            num_epochs=settings.n_epochs,
            clip_param=settings.clip_range,
            vf_clip_param=float("inf"),
            entropy_coeff=settings.ent_coef,
            vf_loss_coeff=settings.vf_coef,
            grad_clip=settings.max_grad_norm,
            grad_clip_by="global_norm",
            use_kl_loss=settings.kl_coeff > 0.0,
            kl_coeff=settings.kl_coeff,
            kl_target=settings.kl_target,
        )
        config.env_runners(rollout_fragment_length=settings.n_steps)
        return config

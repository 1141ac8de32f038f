"""RLlib's proximal policy optimization: PPO, and APPO, which trains while the environments run."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import torch as th
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt
from ray.rllib.algorithms import appo, ppo
from ray.rllib.algorithms.algorithm_config import AlgorithmConfig
from ray.rllib.algorithms.appo.torch.appo_torch_learner import APPOTorchLearner
from ray.rllib.algorithms.ppo.torch.ppo_torch_learner import PPOTorchLearner
from ray.rllib.connectors.learner import GeneralAdvantageEstimation
from ray.rllib.core.columns import Columns
from ray.rllib.core.learner.training_data import TrainingData
from ray.rllib.evaluation.postprocessing import Postprocessing
from ray.rllib.utils.postprocessing.value_predictions import compute_value_targets

from frobs_algos.settings import Activation, Fraction, Schedule, Widths
from frobs_ray.rllib.algorithm import RLlibAlgorithm
from frobs_ray.rllib.config import NetworkConfig, RLlibConfig
from frobs_ray.rllib.networks import ActorCritic


class ActorCriticConfig(NetworkConfig):
    """Settings of the separate policy and value networks of PPO and APPO.

    Attributes:
        net_arch: Widths of the hidden layers of both networks.
        activation_fn: Activation function between the layers.
        ortho_init: Whether the initial weights are orthogonal matrices.
        log_std_init: Logarithm of the initial standard deviation of the actions.
    """

    net_arch: Widths = Field(default=[64, 64])
    activation_fn: Activation = "tanh"
    ortho_init: bool = True
    log_std_init: float = 0.0


class OnPolicyConfig(RLlibConfig):
    """Settings that PPO and APPO share.

    Attributes:
        n_steps: Number of control steps per environment in each iteration.
        clip_range: Maximum deviation of the probability ratio from 1 before the ratio is clipped.
        ent_coef: Weight of the entropy bonus in the loss.
        vf_coef: Weight of the value loss.
        max_grad_norm: Maximum gradient norm, to which larger gradients are clipped.
        policy_kwargs: Settings of the networks.
    """

    n_steps: PositiveInt = 2048
    clip_range: PositiveFloat = 0.2
    ent_coef: NonNegativeFloat = 0.0
    vf_coef: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5
    policy_kwargs: ActorCriticConfig = ActorCriticConfig()


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


class OnPolicy(RLlibAlgorithm):
    """Base class of PPO and APPO."""

    module_class: ClassVar[type[Any]] = ActorCritic
    _config: OnPolicyConfig

    def _configure(self, config: Any, steps: int, **training: Any) -> AlgorithmConfig:
        """Add the shared settings, and those in ``training``, to RLlib's configuration, and return it."""
        settings = self._config
        config.training(
            lr=settings.rates(self.steps, steps),
            gamma=settings.gamma,
            clip_param=settings.clip_range,
            entropy_coeff=settings.ent_coef,
            vf_loss_coeff=settings.vf_coef,
            grad_clip=settings.max_grad_norm,
            grad_clip_by="global_norm",
            **training,
        )
        configured: AlgorithmConfig = config.env_runners(rollout_fragment_length=settings.n_steps)
        return configured


class Advantages(GeneralAdvantageEstimation):
    """Advantages and value targets of the steps of the environments, and of no others.

    RLlib appends one step to every fragment of an episode, to predict the value of the last observation. The advantage
    of this step has no meaning, but RLlib counts it in the normalization, in minibatches and in metrics.
    """

    def __call__(self, *, rl_module: Any, batch: dict[str, Any], **_: Any) -> dict[str, Any]:
        """Add the advantages and the value targets (n,) to the batch of each module, and remove the appended steps."""
        for name, columns in batch.items():
            with th.no_grad():
                values = rl_module[name].compute_values(columns)
            flags = {key: columns[key].cpu().numpy() for key in ("rewards", "terminateds", "truncateds")}
            targets = compute_value_targets(values.cpu().numpy(), **flags, gamma=self.gamma, lambda_=self.lambda_)
            columns[Postprocessing.VALUE_TARGETS] = th.from_numpy(targets).to(values.device)
            columns[Postprocessing.ADVANTAGES] = columns[Postprocessing.VALUE_TARGETS] - values
            real = columns[Columns.LOSS_MASK]
            columns.update({key: column[real] for key, column in columns.items()})
            advantages = columns[Postprocessing.ADVANTAGES]
            advantages.sub_(advantages.mean()).div_(advantages.std(correction=0).clamp(min=1e-4))
        return batch


class _PPOLearner(PPOTorchLearner):
    """RLlib's PPO learner with :class:`Advantages`."""

    def build(self) -> None:
        super().build()
        pipeline: Any = self._learner_connector
        config: Any = self.config
        pipeline.remove(GeneralAdvantageEstimation.__name__)
        pipeline.append(Advantages(gamma=config.gamma, lambda_=config.lambda_))  # type: ignore[no-untyped-call]


class RLlibPPO(OnPolicy):
    """Proximal policy optimization (Schulman et al. 2017)."""

    name: ClassVar[str] = "rllib_ppo"
    config_model: ClassVar[type[RLlibConfig]] = PPOConfig
    _config: PPOConfig

    def rllib_config(self, steps: int) -> AlgorithmConfig:
        settings = self._config
        batch = settings.n_steps * self.env.num_envs
        return self._configure(
            ppo.PPOConfig(),
            steps,
            lambda_=settings.gae_lambda,
            train_batch_size_per_learner=batch,
            minibatch_size=min(settings.batch_size, batch),
            num_epochs=settings.n_epochs,
            vf_clip_param=float("inf"),
            use_kl_loss=settings.kl_coeff > 0.0,
            kl_coeff=settings.kl_coeff,
            kl_target=settings.kl_target,
            learner_class=_PPOLearner,
        )


class _APPOLearner(APPOTorchLearner):
    """RLlib's APPO learner, in which the last observation of a truncated episode has a value.

    For the step that RLlib appends to every fragment of an episode, V-trace replaces the predicted value by the step's
    reward, which is 0. With the predicted value as its reward, the value remains.
    """

    def update(  # type: ignore[override]  # RLlib calls it with these arguments
        self, training_data: TrainingData, **kwargs: Any
    ) -> dict[str, Any]:
        """Take gradient steps, or none if every fragment was lost together with the node that had sampled it."""
        training_data.solve_refs()  # leaves out what was lost
        results: dict[str, Any] = super().update(training_data, **kwargs) if training_data.episodes else {}
        return results

    def compute_loss_for_module(self, *, module_id: str, config: Any, batch: dict[str, Any], fwd_out: Any) -> Any:
        with th.no_grad():
            module: Any = self.module[module_id].unwrapped()
            values = module.compute_values(batch)
        rewards = th.where(batch[Columns.LOSS_MASK], batch[Columns.REWARDS], values)
        batch = {**batch, Columns.REWARDS: rewards}
        return super().compute_loss_for_module(module_id=module_id, config=config, batch=batch, fwd_out=fwd_out)


class RLlibAPPO(OnPolicy):
    """Asynchronous PPO (Luo et al. 2020), which trains while the environments run."""

    name: ClassVar[str] = "rllib_appo"
    config_model: ClassVar[type[RLlibConfig]] = APPOConfig
    has_target_networks: ClassVar[bool] = True
    _config: APPOConfig

    def rllib_config(self, steps: int) -> AlgorithmConfig:
        settings = self._config
        return self._configure(
            appo.APPOConfig(),
            steps,
            train_batch_size_per_learner=settings.batch_size,
            tau=settings.tau,
            target_network_update_freq=settings.target_update_interval,
            circular_buffer_num_batches=settings.buffer_batches,
            circular_buffer_iterations_per_batch=settings.buffer_passes,
            learner_class=_APPOLearner,
        )

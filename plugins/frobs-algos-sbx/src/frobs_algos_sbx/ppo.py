"""Proximal policy optimization whose update runs as one compiled function."""

from __future__ import annotations

from functools import partial
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
import sbx
from flax.training.train_state import TrainState
from gymnasium import spaces
from stable_baselines3.common.utils import FloatSchedule, explained_variance

from frobs_algos_sb3.networks import ActorCriticConfig
from frobs_algos_sb3.on_policy import LEARNING_RATE, Targets
from frobs_algos_sb3.ppo import PPO, PPOConfig
from frobs_algos_sbx.algorithm import JaxAlgorithm
from frobs_algos_sbx.settings import JaxConfig, JaxNetworkConfig


class JaxActorCriticConfig(ActorCriticConfig, JaxNetworkConfig):
    """Settings of PPO's networks."""

    unused: ClassVar[tuple[str, ...]] = ("share_features_extractor", "full_std", "use_expln", "squash_output")


class SbxPPOConfig(PPOConfig, JaxConfig):
    """Settings of PPO. The defaults match those of ``frobs-algos-sb3``.

    The gradients of the policy network and the value network are clipped separately, because the networks are
    separate.
    """

    unsupported: ClassVar[tuple[str, ...]] = ("use_sde", "sde_sample_freq")
    policy_kwargs: JaxActorCriticConfig = JaxActorCriticConfig()


class Rollout(NamedTuple):
    """Steps of a rollout, as arrays with n rows."""

    observations: Any
    actions: Any
    advantages: Any
    returns: Any
    values: Any
    log_probs: Any


class Sums(NamedTuple):
    """Sums of metrics over gradient steps, and the number of gradient steps."""

    steps: Any
    policy_loss: Any
    value_loss: Any
    entropy: Any
    kl: Any
    clipped: Any


class Limits(NamedTuple):
    """Parameters of the update function that may change between updates."""

    clip_range: Any
    clip_range_vf: Any  # infinite if values are not clipped
    target_kl: Any  # infinite if updates never stop early
    ent_coef: Any
    vf_coef: Any


class CompiledPPO(sbx.PPO):
    """sbx's PPO with a different update, which runs all epochs and minibatches in one compiled function.

    The update is equivalent to stable-baselines3's update, including early stopping at ``target_kl``.
    """

    def __init__(self, *args: Any, target_kl: float | None = None, clip_range_vf: Any = None, **kwargs: Any) -> None:
        self._largest_kl = np.inf if target_kl is None else 1.5 * target_kl
        self._value_range = None if clip_range_vf is None else FloatSchedule(clip_range_vf)
        super().__init__(*args, **kwargs)

    def train(self) -> None:
        """Train on the rollout."""
        buffer, progress, policy = self.rollout_buffer, self._current_progress_remaining, self.policy
        self._update_learning_rate(
            [policy.actor_state.opt_state[1], policy.vf_state.opt_state[1]], self.lr_schedule(progress)
        )
        actions = buffer.actions
        if isinstance(self.action_space, spaces.Discrete):
            actions = actions.astype(np.int32)[..., 0]
        arrays = (buffer.observations, actions, buffer.advantages, buffer.returns, buffer.values, buffer.log_probs)
        rollout = Rollout(*(array.reshape(-1, *array.shape[2:]) for array in arrays))
        n = len(rollout.returns)
        order = np.stack([np.random.permutation(n) for _ in range(self.n_epochs)])  # noqa: NPY002  # SB3 uses it
        limits = Limits(
            self.clip_range_schedule(progress),
            np.inf if self._value_range is None else self._value_range(progress),
            self._largest_kl,
            self.ent_coef,
            self.vf_coef,
        )
        policy.actor_state, policy.vf_state, sums = update(
            policy.actor_state,
            policy.vf_state,
            rollout,
            order,
            limits,
            min(self.batch_size, n),
            self.normalize_advantage,
        )
        self._n_updates += self.n_epochs
        self._log(sums, explained_variance(rollout.values, rollout.returns), limits.clip_range)

    def _log(self, sums: Sums, explained: float, clip_range: float) -> None:
        steps = max(float(sums.steps), 1.0)
        record = self.logger.record
        record("train/policy_gradient_loss", float(sums.policy_loss) / steps)
        record("train/value_loss", float(sums.value_loss) / steps)
        record("train/entropy_loss", -float(sums.entropy) / steps)
        record("train/approx_kl", float(sums.kl) / steps)
        record("train/clip_fraction", float(sums.clipped) / steps)
        record("train/explained_variance", explained)
        record("train/clip_range", clip_range)
        record("train/n_updates", self._n_updates)
        log_std = self.policy.actor_state.params["params"].get("log_std")
        if log_std is not None:
            record("train/std", float(np.exp(log_std).mean()))


@partial(jax.jit, static_argnames=("batch_size", "normalize"))
def update(
    actor: TrainState,
    critic: TrainState,
    rollout: Rollout,
    order: jax.Array,
    limits: Limits,
    batch_size: int,
    normalize: bool,
) -> tuple[TrainState, TrainState, Sums]:
    """Run all epochs of an update, and return the updated networks and the sums of the metrics.

    Args:
        actor: State of the policy network.
        critic: State of the value network.
        rollout: The n steps on which to train.
        order: Permutation of the steps for each epoch (epochs, n).
        limits: Coefficients and bounds.
        batch_size: Number of rollout steps in each minibatch. The last minibatch of an epoch may be smaller.
        normalize: Whether to normalize the advantages in each minibatch.
    """

    def step(carry: Any, rows: jax.Array) -> tuple[Any, None]:
        going = carry[2]
        return jax.lax.cond(going, partial(learn, rows=rows), lambda unchanged: unchanged, carry), None

    def learn(carry: Any, rows: jax.Array) -> Any:
        actor, critic, _, sums = carry
        batch = jax.tree_util.tree_map(lambda array: array[rows], rollout)
        gradients, losses = _gradients(actor, critic, batch, limits, normalize and batch_size > 1)
        going = losses.kl <= limits.target_kl
        learned = actor.apply_gradients(grads=gradients[0]), critic.apply_gradients(grads=gradients[1])
        actor, critic = jax.tree_util.tree_map(lambda new, old: jnp.where(going, new, old), learned, (actor, critic))
        return actor, critic, going, jax.tree_util.tree_map(jnp.add, sums, losses)

    def epoch(carry: Any, rows: jax.Array) -> tuple[Any, None]:
        full_batches = len(rows) // batch_size
        carry, _ = jax.lax.scan(step, carry, rows[: full_batches * batch_size].reshape(full_batches, batch_size))
        if full_batches * batch_size < len(rows):
            carry, _ = step(carry, rows[full_batches * batch_size :])
        return carry, None

    start = (actor, critic, jnp.bool_(True), Sums(*[jnp.float32(0.0)] * len(Sums._fields)))
    (actor, critic, _, sums), _ = jax.lax.scan(epoch, jax.tree_util.tree_map(jnp.asarray, start), order)
    return actor, critic, sums


def _gradients(
    actor: TrainState, critic: TrainState, batch: Rollout, limits: Limits, normalize: bool
) -> tuple[tuple[Any, Any], Sums]:
    """Return the gradients of both networks for a batch, and the metrics to log."""
    advantages = batch.advantages
    if normalize and len(advantages) > 1:
        advantages = (advantages - advantages.mean()) / (advantages.std(ddof=1) + 1e-8)

    def policy_loss(params: Any) -> tuple[jax.Array, tuple[jax.Array, jax.Array, jax.Array]]:
        distribution = actor.apply_fn(params, batch.observations)
        log_ratio = distribution.log_prob(batch.actions) - batch.log_probs
        ratio = jnp.exp(log_ratio)
        clipped = jnp.clip(ratio, 1.0 - limits.clip_range, 1.0 + limits.clip_range)
        loss = -jnp.minimum(advantages * ratio, advantages * clipped).mean()
        entropy = distribution.entropy().mean()
        return loss - limits.ent_coef * entropy, (loss, entropy, log_ratio)

    def value_loss(params: Any) -> jax.Array:
        values = critic.apply_fn(params, batch.observations).flatten()
        near = batch.values + jnp.clip(values - batch.values, -limits.clip_range_vf, limits.clip_range_vf)
        return jnp.asarray(limits.vf_coef * ((batch.returns - near) ** 2).mean())

    (_, (loss, entropy, log_ratio)), policy_gradient = jax.value_and_grad(policy_loss, has_aux=True)(actor.params)
    squared, value_gradient = jax.value_and_grad(value_loss)(critic.params)
    ratio = jnp.exp(log_ratio)
    losses = Sums(
        steps=jnp.float32(1.0),
        policy_loss=loss,
        value_loss=squared / limits.vf_coef,
        entropy=entropy,
        kl=(ratio - 1.0 - log_ratio).mean(),
        clipped=(jnp.abs(ratio - 1.0) > limits.clip_range).mean(),
    )
    return (policy_gradient, value_gradient), losses


class SbxPPO(JaxAlgorithm, PPO):
    """Proximal policy optimization (Schulman et al. 2017)."""

    name = "sbx_ppo"
    config_model = SbxPPOConfig
    model_class = CompiledPPO

    def _imitate(self, targets: Targets, updates: int) -> None:
        policy: Any = self.model.policy
        actor, critic, continuous = policy.actor_state, policy.vf_state, isinstance(self.action_space, spaces.Box)
        optimizer = optax.adam(optax.linear_schedule(LEARNING_RATE, 0.0, updates))

        def loss(params: Any, batch: dict[str, jax.Array]) -> jax.Array:
            distribution = actor.apply_fn(params[0], batch["observation"])
            if continuous:
                error = jnp.square(distribution.mode() - batch["action"]).mean()
            else:
                error = -distribution.log_prob(batch["action"]).mean()
            value, last_value = (
                critic.apply_fn(params[1], batch[name]).flatten() for name in ("observation", "last_observation")
            )
            returns = batch["returns"] + batch["bootstrap"] * jax.lax.stop_gradient(last_value)
            return jnp.asarray(error + jnp.square(value - returns).mean())

        @jax.jit
        def learn(params: Any, optimizer_state: Any, batch: dict[str, jax.Array]) -> tuple[Any, Any]:
            changes, optimizer_state = optimizer.update(jax.grad(loss)(params, batch), optimizer_state)
            return optax.apply_updates(params, changes), optimizer_state

        params = actor.params, critic.params
        optimizer_state = optimizer.init(params)
        for batch in targets.batches(updates, self._seed):
            params, optimizer_state = learn(params, optimizer_state, batch)
        policy.actor_state, policy.vf_state = actor.replace(params=params[0]), critic.replace(params=params[1])

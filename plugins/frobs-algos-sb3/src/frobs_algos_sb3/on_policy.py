"""Base class of on-policy algorithms, whose networks can start from another policy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.utils import obs_as_tensor
from torch.nn.functional import mse_loss

from frobs_algos import demonstrations
from frobs_algos.demonstrations import Demonstrations, take
from frobs_algos_sb3 import state
from frobs_algos_sb3.algorithm import SB3Algorithm
from frobs_algos_sb3.config import OnPolicyConfig
from frobs_core.description import Observation

Array = np.ndarray[Any, Any]

LEARNING_RATE = 1e-3
"""Initial learning rate of the imitation, which decreases linearly to 0."""

_BATCH_SIZE = 256


@dataclass(frozen=True, kw_only=True)
class Targets:
    """Targets of the networks for n steps of an initial policy."""

    observation: Observation  # (n, k) inputs of the networks, or a dictionary of arrays
    action: Array  # (n, …)
    returns: Array  # (n,) discounted sums of the rewards until the end of the episode
    bootstrap: Array  # (n,) weights of the value of ``last_observation`` in the return; 0 after a terminal state
    last_observation: Observation  # after the last step of the episode, in the form of ``observation``

    def batches(self, count: int, seed: int) -> Iterator[dict[str, Any]]:
        """Draw batches, as dictionaries of the attributes."""
        generator = np.random.default_rng(seed)
        for _ in range(count):
            rows = generator.integers(len(self.returns), size=_BATCH_SIZE)
            yield {name: take(value, rows) for name, value in vars(self).items()}


class OnPolicy(SB3Algorithm):
    """Base class of on-policy algorithms."""

    _config: OnPolicyConfig
    model: OnPolicyAlgorithm

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], config: Mapping[str, Any], seed: int) -> None:
        super().__init__(env, config, seed)
        name = self._config.initial_policy
        if name is not None:
            # With the noise of the first rollouts, the episodes visit the same states and have the same returns.
            noise = 0.0 if self._config.use_sde else math.exp(self._config.policy_kwargs.log_std_init)
            episodes = self._config.initial_episodes
            played = self._demonstrate(lambda env, seed: demonstrations.collect(env, name, episodes, seed, noise))
            self._imitate(self._targets(played), self._config.initial_updates)

    def _make_model(self, policy: str, **kwargs: Any) -> BaseAlgorithm:
        # The buffer is copied when its steps are shuffled.
        self._require_memory("n_steps", self._config.n_steps, 2 * self.venv.num_envs)
        return super()._make_model(policy, **kwargs)

    def _targets(self, played: Demonstrations) -> Targets:
        """Return the targets of the networks. Initializes the statistics of the normalizer."""
        start, end, gamma = played.episode_start, played.episode_end, self._config.gamma
        observation, following, reward, action = (
            played.observation,
            played.next_observation,
            played.reward,
            played.action,
        )
        assert following is not None
        if self.normalizer is not None:
            statistics = state.running_statistics(self.normalizer)
            statistics["reward"].update(_discounted(reward, start, gamma))
            for key, part in (observation if isinstance(observation, dict) else {"": observation}).items():
                if self.normalizer.norm_obs:
                    statistics[f"observation/{key}"].update(part)
            reward = self.normalizer.normalize_reward(reward)
            observation, following = map(self.normalizer.normalize_obs, (observation, following))
        if isinstance(self.action_space, spaces.Box):
            action = action.reshape(len(action), -1)
            if self.model.policy.squash_output:
                action = self.model.policy.scale_action(action)
        last_rows = np.flatnonzero(end)[np.cumsum(start) - 1]
        truncated = gamma * (end & ~played.terminated)
        return Targets(
            observation=observation,
            action=action,
            returns=_discounted(reward[::-1], end[::-1], gamma)[::-1],
            bootstrap=_discounted(truncated[::-1], end[::-1], gamma)[::-1],
            last_observation=take(following, last_rows),
        )

    def _imitate(self, targets: Targets, updates: int) -> None:
        """Fit the mean actions, or the probabilities of discrete actions, and the values of the networks."""
        policy: Any = self.model.policy
        optimizer = th.optim.Adam(policy.parameters(), LEARNING_RATE)
        schedule = th.optim.lr_scheduler.LinearLR(optimizer, 1.0, 0.0, updates)
        policy.set_training_mode(True)
        for batch in targets.batches(updates, self._seed):
            tensors: dict[str, Any] = {name: obs_as_tensor(value, policy.device) for name, value in batch.items()}
            distribution = policy.get_distribution(tensors["observation"])
            if isinstance(self.action_space, spaces.Box):
                loss = mse_loss(distribution.mode(), tensors["action"])
            else:
                loss = -distribution.log_prob(tensors["action"]).mean()
            with th.no_grad():
                last_value = policy.predict_values(tensors["last_observation"]).flatten()
            returns = tensors["returns"] + tensors["bootstrap"] * last_value
            loss = loss + mse_loss(policy.predict_values(tensors["observation"]).flatten(), returns)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
        policy.set_training_mode(False)


def _discounted(values: Array, restart: Array, gamma: float) -> Array:
    """Return running sums (n,), to each of which the previous sum is added with a discount unless it restarts."""
    sums, total = np.empty(len(values), np.float32), 0.0
    for row, value in enumerate(values):
        total = float(value) + (0.0 if restart[row] else gamma * total)
        sums[row] = total
    return sums

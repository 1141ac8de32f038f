"""Stable-baselines3 policies as traceable modules, equivalent to ``predict`` with ``deterministic=True``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from frobs_algos.onnx import TraceablePolicy
from frobs_algos_sb3.onnx_lstm import LstmStep
from frobs_algos_sb3.onnx_observation import ObservationInput
from frobs_core.util.errors import PolicyExportError


class PolicyGraph(TraceablePolicy):
    """A policy that maps an observation to an action.

    Args:
        network: Network that maps the preprocessed observation to the mode of the action distribution or to the scores
            of discrete choices.
        inputs: Preprocessing for each part of the observation, by key.
        action_space: Action space of the environment.
        squashed: Whether the network's output is in [−1, 1] and must be scaled to the bounds of the action space.
    """

    def __init__(
        self,
        network: nn.Module,
        inputs: Mapping[str, ObservationInput],
        action_space: spaces.Space[Any],
        squashed: bool,
    ) -> None:
        super().__init__()
        self.keys = list(inputs)
        self.observation_inputs = nn.ModuleList(inputs.values())
        self.action_space, self.network, self.squashed = action_space, network, squashed
        if isinstance(self.action_space, spaces.Box):
            self.register_buffer("low", th.as_tensor(self.action_space.low, dtype=th.float32))
            self.register_buffer("high", th.as_tensor(self.action_space.high, dtype=th.float32))

    @property
    def lstm(self) -> LstmStep | None:
        """The LSTM step that updates the policy's state, or None if the policy is not recurrent."""
        step = getattr(self.network, "lstm", None)
        return step if isinstance(step, LstmStep) else None

    def examples(self, batch: int) -> dict[str, th.Tensor]:
        """Return example inputs of the correct shapes and types, by name."""
        inputs: dict[str, th.Tensor] = {}
        for key, part in zip(self.keys, self.observation_inputs, strict=True):
            assert isinstance(part, ObservationInput)
            inputs[f"observation/{key}" if key else "observation"] = part.example(batch)
        if self.lstm is not None:
            shape = (batch, self.lstm.layers, self.lstm.hidden_size)
            inputs |= {f"state/{i}": th.zeros(shape) for i in range(2)}
            inputs["episode_start"] = th.zeros(batch, dtype=th.bool)
        return inputs

    def output_names(self) -> list[str]:
        """Return the names of the outputs of :meth:`forward`."""
        names = ["action"] if isinstance(self.action_space, spaces.Box) else ["action", "scores"]
        return names if self.lstm is None else [*names, "next_state/0", "next_state/1"]

    def forward(self, *arguments: th.Tensor) -> tuple[th.Tensor, ...]:
        """Return the action, the scores of discrete choices, and the next state of a recurrent policy."""
        parts = [part(value) for part, value in zip(self.observation_inputs, arguments, strict=False)]
        observation = parts[0] if self.keys == [""] else dict(zip(self.keys, parts, strict=True))
        raw, *state = self.network(observation, *arguments[len(self.keys) :])
        return (*self._act(raw), *state)

    def _act(self, raw: th.Tensor) -> tuple[th.Tensor, ...]:
        space = self.action_space
        if isinstance(space, spaces.Discrete):
            return raw.argmax(dim=-1), raw
        if isinstance(space, spaces.MultiDiscrete):
            choices = th.split(raw, space.nvec.tolist(), dim=-1)
            return th.stack([choice.argmax(dim=-1) for choice in choices], dim=-1), raw
        if isinstance(space, spaces.MultiBinary):
            return (raw > 0.0).to(th.int8), raw  # logits: positive for probabilities above one half
        assert isinstance(self.low, th.Tensor)
        assert isinstance(self.high, th.Tensor)
        action = raw.reshape(-1, *self.low.shape)
        if self.squashed:
            action = self.low + 0.5 * (action + 1.0) * (self.high - self.low)
        return (th.minimum(th.maximum(action, self.low), self.high),)


class ActorCritic(nn.Module):
    """Module that returns an on-policy algorithm's most probable action, or the scores of discrete choices."""

    def __init__(self, policy: ActorCriticPolicy) -> None:
        super().__init__()
        self.features = policy.pi_features_extractor
        lstm = getattr(policy, "lstm_actor", None)
        self.lstm = None if lstm is None else LstmStep(lstm)
        self.latent = policy.mlp_extractor.policy_net
        self.action = policy.action_net
        self.squashed = policy.squash_output

    def forward(self, observation: Any, *state: th.Tensor) -> tuple[th.Tensor, ...]:
        """Return the mode or the scores, and the next state of a recurrent policy."""
        features = self.features(observation)
        if self.lstm is not None:
            features, *state = self.lstm(features, *state)
        mode = self.action(self.latent(features))
        return (th.tanh(mode) if self.squashed else mode, *state)


class StochasticActor(nn.Module):
    """Module that returns the mode of the action distribution, for SAC and related algorithms."""

    def __init__(self, actor: Any) -> None:
        super().__init__()
        self.features, self.latent, self.mean = actor.features_extractor, actor.latent_pi, actor.mu

    def forward(self, observation: Any) -> tuple[th.Tensor, ...]:
        """Return the mode, in [−1, 1]."""
        return (th.tanh(self.mean(self.latent(self.features(observation)))),)


class Features(nn.Module):
    """A features extractor followed by a network, such as TD3's actor or DQN's Q-network."""

    def __init__(self, features: nn.Module, network: nn.Module) -> None:
        super().__init__()
        self.features, self.network = features, network

    def forward(self, observation: Any) -> tuple[th.Tensor, ...]:
        """Return the network's output."""
        return (self.network(self.features(observation)),)


def network_of(model: BaseAlgorithm) -> nn.Module:
    """Return the network that selects actions, or raise PolicyExportError if the policy's structure is unknown."""
    policy: Any = model.policy
    if isinstance(policy, ActorCriticPolicy):
        return ActorCritic(policy)
    actor: Any = getattr(policy, "actor", None)
    values: Any = getattr(policy, "q_net", None)
    if hasattr(actor, "latent_pi"):
        return StochasticActor(actor)
    if hasattr(actor, "mu"):
        return Features(actor.features_extractor, actor.mu)
    if hasattr(values, "q_net"):
        return Features(values.features_extractor, values.q_net)
    raise PolicyExportError(
        f"a policy of the class {type(policy).__name__}",
        "only actor-critic policies, actors that output a mean, and Q-networks are supported.",
    )

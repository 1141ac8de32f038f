"""Exports stable-baselines3's policies, equivalent to ``predict`` with ``deterministic=True``, as ONNX graphs."""

from __future__ import annotations

from typing import Any

import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.preprocessing import is_image_space
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from frobs_algos.onnx_policy import Normalization, ObservationInput, PolicyGraph
from frobs_algos.spaces import subspaces
from frobs_core.util.errors import PolicyExportError


def policy_graph(model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]) -> PolicyGraph:
    """Return a model's deterministic policy as a module for the export. Sets the model to evaluation mode."""
    seen = subspaces(model.policy.observation_space)
    inputs = {
        key: _observation_input(part, seen[key], normalization(normalizer, key))
        for key, part in subspaces(space).items()
    }
    model.policy.set_training_mode(False)
    network = network_of(model)
    lstm = network.lstm
    state_shapes = [] if lstm is None else [(lstm.layers, lstm.hidden_size)] * 2
    squashed = bool(model.policy.squash_output)
    return PolicyGraph(network, space, model.action_space, squashed, inputs, state_shapes)


def normalization(normalizer: VecNormalize | None, key: str) -> Normalization | None:
    """Return the normalization of a part of the observation, or None if the part is not normalized."""
    if normalizer is None or not normalizer.norm_obs:
        return None
    statistics: Any = normalizer.obs_rms
    if isinstance(statistics, dict):
        if key not in (normalizer.norm_obs_keys or ()):
            return None
        statistics = statistics[key]
    return Normalization(statistics.mean, statistics.var, normalizer.epsilon, normalizer.clip_obs)


def _observation_input(
    space: spaces.Space[Any], seen: spaces.Space[Any], normalization: Normalization | None
) -> ObservationInput:
    """Return the preprocessing of a part of the observation, for which the policy sees the space ``seen``.

    The module performs the operations of stable-baselines3's ``VecNormalize.normalize_obs``, ``obs_to_tensor`` and
    ``preprocess_obs`` in the same order and precision. The original code cannot be traced, because it depends on the
    values of the observations.
    """
    is_box = isinstance(seen, spaces.Box)
    image, transposed = is_box and is_image_space(seen), is_box and seen.shape != space.shape
    return ObservationInput(space, normalization, image=image, transposed=transposed)


class Network(nn.Module):
    """Module that returns the most probable action, or the scores of discrete choices."""

    def __init__(self, features: nn.Module, *layers: nn.Module, lstm: nn.LSTM | None = None) -> None:
        super().__init__()
        self.features, self.layers = features, nn.Sequential(*layers)
        self.lstm = None if lstm is None else LstmStep(lstm)

    def forward(self, observation: Any, *state: th.Tensor) -> tuple[th.Tensor, ...]:
        """Return the mode or the scores, and the next state of a recurrent policy."""
        features = self.features(observation)
        if self.lstm is not None:
            features, *state = self.lstm(features, *state)
        return (self.layers(features), *state)


def network_of(model: BaseAlgorithm) -> Network:
    """Return the network that selects actions, or raise PolicyExportError if the policy's structure is unknown."""
    policy: Any = model.policy
    if isinstance(policy, ActorCriticPolicy):
        squashing = [nn.Tanh()] if policy.squash_output else []
        layers = policy.mlp_extractor.policy_net, policy.action_net, *squashing
        return Network(policy.pi_features_extractor, *layers, lstm=getattr(policy, "lstm_actor", None))
    actor: Any = getattr(policy, "actor", None)
    values: Any = getattr(policy, "q_net", None)
    if hasattr(actor, "latent_pi"):
        return Network(actor.features_extractor, actor.latent_pi, actor.mu, nn.Tanh())
    if hasattr(actor, "mu"):
        return Network(actor.features_extractor, actor.mu)
    if hasattr(values, "q_net"):
        return Network(values.features_extractor, values.q_net)
    raise PolicyExportError(
        f"a policy of the class {type(policy).__name__}",
        "only actor-critic policies, actors that output a mean, and Q-networks are supported.",
    )


class LstmStep(nn.Module):
    """Module that advances an LSTM by one step, and starts each episode with a zero state."""

    def __init__(self, lstm: nn.LSTM) -> None:
        super().__init__()
        if lstm.bidirectional or lstm.proj_size:
            raise PolicyExportError(
                "the LSTM", "bidirectional LSTMs and LSTMs with projected outputs are not supported."
            )
        self.layers, self.hidden_size = lstm.num_layers, lstm.hidden_size
        self.inputs, self.recurrences = nn.ModuleList(), nn.ModuleList()
        for layer in range(lstm.num_layers):
            self.inputs.append(_linear(lstm, f"ih_l{layer}"))
            self.recurrences.append(_linear(lstm, f"hh_l{layer}"))

    def forward(self, features: th.Tensor, hidden: th.Tensor, cell: th.Tensor, start: th.Tensor) -> Any:
        """Return the output, (batch, hidden_size), and the next hidden and cell states.

        Args:
            features: Inputs, (batch, …).
            hidden: Hidden state, (batch, layers, hidden_size).
            cell: Cell state, (batch, layers, hidden_size).
            start: (batch,) bool, True at the start of an episode.
        """
        kept = 1.0 - start.float()[:, None]
        hiddens, cells = [], []
        for layer, (of_input, of_state) in enumerate(zip(self.inputs, self.recurrences, strict=True)):
            gates = of_input(features) + of_state(kept * hidden[:, layer])
            ingoing, kept_share, new, outgoing = th.chunk(gates, 4, dim=-1)
            memory = th.sigmoid(kept_share) * (kept * cell[:, layer]) + th.sigmoid(ingoing) * th.tanh(new)
            features = th.sigmoid(outgoing) * th.tanh(memory)
            hiddens.append(features)
            cells.append(memory)
        return features, th.stack(hiddens, dim=1), th.stack(cells, dim=1)


def _linear(lstm: nn.LSTM, name: str) -> nn.Linear:
    """Return a linear layer with one of the LSTM's weight matrices and the corresponding bias."""
    weight = getattr(lstm, f"weight_{name}")
    layer = nn.Linear(weight.shape[1], weight.shape[0], bias=lstm.bias)
    layer.weight = weight
    if lstm.bias:
        layer.bias = getattr(lstm, f"bias_{name}")
    return layer

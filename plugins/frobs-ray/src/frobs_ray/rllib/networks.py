"""RLlib modules with the networks of the algorithms, for flat observations.

For continuous actions, the output range [−1, 1] corresponds to the bounds of the environment's action space. Discrete
actions start at 0. Each module has the property ``mode``, the network that maps observations to the most probable
action or to the scores of discrete actions, and the method ``act``, which samples actions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import torch as th
from gymnasium import spaces
from ray.rllib.algorithms.sac.torch.default_sac_torch_rl_module import DefaultSACTorchRLModule
from ray.rllib.core.columns import Columns
from ray.rllib.core.distribution.torch.torch_distribution import TorchSquashedGaussian
from ray.rllib.core.learner.utils import make_target_network
from ray.rllib.core.models.base import ENCODER_OUT
from ray.rllib.core.rl_module.apis import (
    TARGET_NETWORK_ACTION_DIST_INPUTS,
    InferenceOnlyAPI,
    TargetNetworkAPI,
    ValueFunctionAPI,
)
from ray.rllib.core.rl_module.torch import TorchRLModule
from torch import nn

from frobs_algos.onnx_policy import Scale
from frobs_algos.settings import ACTIVATIONS

_LOG_2_PI = 1.8378770664093453
_LOG_STD = (-20.0, 2.0)  # bounds of SAC's log standard deviations, as in the paper's implementation


class GaussianActor(nn.Module):
    """Network that maps observations to means, with one trainable log standard deviation per action component."""

    def __init__(self, body: nn.Module, size: int, log_std: float) -> None:
        super().__init__()
        self.body = body
        self.log_std = nn.Parameter(th.full((size,), log_std))

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return the means and the log standard deviations (batch, 2 n)."""
        mean = self.body(observation)
        return th.cat([mean, self.log_std.expand_as(mean)], dim=-1)


class ActorCritic(TorchRLModule, InferenceOnlyAPI, ValueFunctionAPI, TargetNetworkAPI):
    """A policy network and a value network, for PPO and APPO."""

    def setup(self) -> None:
        """Build the networks."""
        config: Any = self.model_config
        observation, action = cast(spaces.Box, self.observation_space), cast(Any, self.action_space)
        self.is_discrete = isinstance(action, spaces.Discrete)
        outputs = int(action.n) if self.is_discrete else int(action.shape[0])
        networks = []
        for size, gain in ((outputs, 0.01), (1, 1.0)):
            layers, width = _hidden_layers(observation.shape[0], config["net_arch"], config["activation_fn"])
            network = nn.Sequential(Scale(config["scale"]), *layers, nn.Linear(width, size))
            if config["ortho_init"]:
                _make_orthogonal(network, gain)
            networks.append(network)
        actor, self.critic = networks
        self.actor = actor if self.is_discrete else GaussianActor(actor, outputs, config["log_std_init"])

    @property
    def mode(self) -> nn.Module:
        """Network that maps observations to the most probable action, or to the scores of discrete actions."""
        return self.actor.body if isinstance(self.actor, GaussianActor) else self.actor

    def act(self, observation: th.Tensor, generator: th.Generator) -> dict[str, th.Tensor]:
        """Return sampled actions for observations (batch, k), their log probabilities, and the distribution's inputs."""
        inputs = self.actor(observation)
        if self.is_discrete:
            log_probabilities = th.log_softmax(inputs, dim=-1)
            action = th.multinomial(log_probabilities.exp(), 1, generator=generator).squeeze(-1)
            logp = log_probabilities.gather(-1, action.unsqueeze(-1)).squeeze(-1)
        else:
            mean, log_std = inputs.chunk(2, dim=-1)
            noise = th.randn(mean.shape, generator=generator)
            action = mean + log_std.exp() * noise
            logp = -(0.5 * noise.square() + log_std + 0.5 * _LOG_2_PI).sum(-1)
        return {Columns.ACTIONS: action, Columns.ACTION_LOGP: logp, Columns.ACTION_DIST_INPUTS: inputs}

    def _forward(self, batch: dict[str, Any], **kwargs: Any) -> dict[str, Any]:
        return {Columns.ACTION_DIST_INPUTS: self.actor(batch[Columns.OBS])}

    def compute_values(self, batch: dict[str, Any], embeddings: Any = None) -> th.Tensor:
        """Return the state values of the observations (batch,)."""
        values: th.Tensor = self.critic(batch[Columns.OBS]).squeeze(-1)
        return values

    def make_target_networks(self) -> None:
        """Create the target copy of the actor."""
        self.target_actor = make_target_network(self.actor)

    def get_target_network_pairs(self) -> list[tuple[nn.Module, nn.Module]]:
        """Return the actor and its target copy."""
        return [(self.actor, self.target_actor)]

    def forward_target(self, batch: dict[str, Any]) -> dict[str, Any]:
        """Return the outputs of the actor's target copy."""
        return {TARGET_NETWORK_ACTION_DIST_INPUTS: self.target_actor(batch[Columns.OBS])}

    def get_non_inference_attributes(self) -> list[str]:
        """Return the networks that environment runners do not need."""
        return ["critic", "target_actor"]


class _Encoder(nn.Module):
    """Hidden layers for scaled observations, or for scaled observations and actions."""

    def __init__(self, config: Any, actions: int = 0) -> None:
        super().__init__()
        self.scale = Scale(config["scale"])
        inputs = len(config["scale"]) + actions
        layers, self.width = _hidden_layers(inputs, config["net_arch"], config["activation_fn"])
        self.layers = nn.Sequential(*layers)
        self.joins = actions > 0

    def forward(self, batch: dict[str, th.Tensor]) -> dict[str, th.Tensor]:
        inputs = self.scale(batch[Columns.OBS])
        if self.joins:
            inputs = th.cat([inputs, batch[Columns.ACTIONS]], dim=-1)
        return {ENCODER_OUT: self.layers(inputs)}


class _SquashedHead(nn.Linear):
    """Output layer for means and bounded log standard deviations."""

    def forward(self, input: th.Tensor) -> th.Tensor:
        mean, log_std = super().forward(input).chunk(2, dim=-1)
        return th.cat([mean, log_std.clamp(*_LOG_STD)], dim=-1)


class SoftActorCritic(DefaultSACTorchRLModule):
    """A squashed Gaussian policy with actions in [−1, 1], and two action-value networks, for SAC."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kwargs.pop("catalog_class", None)
        TorchRLModule.__init__(self, *args, **kwargs)  # skip RLlib's catalog of networks

    def setup(self) -> None:
        """Build the networks from the parts that RLlib's SAC expects."""
        actions = cast(spaces.Box, self.action_space).shape[0]
        self.twin_q = True
        self.action_dist_cls = TorchSquashedGaussian
        self.pi_encoder = _Encoder(self.model_config)
        self.pi = _SquashedHead(self.pi_encoder.width, 2 * actions)
        if not self.inference_only:
            self.qf_encoder = _Encoder(self.model_config, actions)
            self.qf = nn.Linear(self.qf_encoder.width, 1)
            self.qf_twin_encoder = _Encoder(self.model_config, actions)
            self.qf_twin = nn.Linear(self.qf_twin_encoder.width, 1)

    @property
    def mode(self) -> nn.Module:
        """Network that maps observations to the mean of the policy's actions, squashed to [−1, 1]."""
        return nn.Sequential(self.pi_encoder.scale, self.pi_encoder.layers, self.pi, _SquashedMean())

    def act(self, observation: th.Tensor, generator: th.Generator) -> dict[str, th.Tensor]:
        """Return sampled actions for observations (batch, k)."""
        mean, log_std = self.pi(self.pi_encoder({Columns.OBS: observation})[ENCODER_OUT]).chunk(2, dim=-1)
        noise = th.randn(mean.shape, generator=generator)
        return {Columns.ACTIONS: th.tanh(mean + log_std.exp() * noise)}


class _SquashedMean(nn.Module):
    def forward(self, inputs: th.Tensor) -> th.Tensor:
        return th.tanh(inputs.chunk(2, dim=-1)[0])


def _hidden_layers(inputs: int, widths: Sequence[int], activation: str) -> tuple[list[nn.Module], int]:
    """Return linear layers with activations, and the width of the last layer."""
    layers: list[nn.Module] = []
    for width in widths:
        layers += [nn.Linear(inputs, width), getattr(nn, ACTIVATIONS[activation])()]
        inputs = width
    return layers, inputs


def _make_orthogonal(network: nn.Module, last_gain: float) -> None:
    """Initialize linear layers with orthogonal weights and zero biases, scaling the last layer by ``last_gain``."""
    layers = [layer for layer in network.modules() if isinstance(layer, nn.Linear)]
    for layer in layers:
        nn.init.orthogonal_(layer.weight, last_gain if layer is layers[-1] else 2.0**0.5)
        nn.init.zeros_(layer.bias)

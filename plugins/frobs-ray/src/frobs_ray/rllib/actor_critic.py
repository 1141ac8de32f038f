"""RLlib module with the networks of PPO and APPO."""

from __future__ import annotations

from typing import Any, cast

import torch as th
from gymnasium import spaces
from ray.rllib.core.columns import Columns
from ray.rllib.core.learner.utils import make_target_network
from ray.rllib.core.rl_module.apis import (
    TARGET_NETWORK_ACTION_DIST_INPUTS,
    InferenceOnlyAPI,
    TargetNetworkAPI,
    ValueFunctionAPI,
)
from ray.rllib.core.rl_module.torch import TorchRLModule
from torch import nn

from frobs_ray.rllib.networks import GaussianActor, Scale, hidden_layers, orthogonal

_LOG_2_PI = 1.8378770664093453


class ActorCritic(TorchRLModule, InferenceOnlyAPI, ValueFunctionAPI, TargetNetworkAPI):
    """A policy network and a value network for flat observations.

    For continuous actions, the output range [−1, 1] corresponds to the bounds of the environment's action space.
    Discrete actions start at 0.

    Attributes:
        actor: Network that maps observations (batch, k) to means and log standard deviations, or to scores of discrete
            actions.
        critic: Network that maps observations (batch, k) to state values (batch, 1).
        target_actor: Copy of the actor with earlier weights, used only by APPO.
    """

    def setup(self) -> None:
        """Build the networks."""
        config: Any = self.model_config
        observation, action = cast(spaces.Box, self.observation_space), cast(Any, self.action_space)
        inputs = observation.shape[0]
        outputs = int(action.n) if self.is_discrete else int(action.shape[0])
        networks = []
        for size, gain in ((outputs, 0.01), (1, 1.0)):
            layers, width = hidden_layers(inputs, config["net_arch"], config["activation_fn"])
            network = nn.Sequential(Scale(config["scale"]), *layers, nn.Linear(width, size))
            if config["ortho_init"]:
                orthogonal(network, gain)
            networks.append(network)
        actor, self.critic = networks
        self.actor = actor if self.is_discrete else GaussianActor(actor, outputs, config["log_std_init"])

    @property
    def is_discrete(self) -> bool:
        """Whether actions are discrete."""
        return isinstance(self.action_space, spaces.Discrete)

    @property
    def mode(self) -> nn.Module:
        """Network that maps observations to the most probable action, or to the scores of discrete actions."""
        return self.actor.body if isinstance(self.actor, GaussianActor) else self.actor

    def act(self, observation: th.Tensor, generator: th.Generator) -> dict[str, th.Tensor]:
        """Sample actions for a batch of observations.

        Args:
            observation: Observations (batch, k).
            generator: Random number generator.

        Returns:
            Dictionary with RLlib's keys for the actions, their log probabilities, and the inputs of the action
            distribution.
        """
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

"""RLlib module with the networks of SAC."""

from __future__ import annotations

from typing import Any, cast

import torch as th
from gymnasium import spaces
from ray.rllib.algorithms.sac.torch.default_sac_torch_rl_module import DefaultSACTorchRLModule
from ray.rllib.core.columns import Columns
from ray.rllib.core.distribution.torch.torch_distribution import TorchSquashedGaussian
from ray.rllib.core.models.base import ENCODER_OUT
from ray.rllib.core.rl_module.torch import TorchRLModule
from torch import nn

from frobs_ray.rllib.networks import Scale, hidden_layers

_LOG_STD = (-20.0, 2.0)  # bounds of log standard deviations, as in the paper's implementation


class _Encoder(nn.Module):
    """Hidden layers for scaled observations, or for scaled observations and actions."""

    def __init__(self, scale: list[float], actions: int, widths: list[int], activation: str) -> None:
        super().__init__()
        self.scale = Scale(scale)
        layers, self.width = hidden_layers(len(scale) + actions, widths, activation)
        self.layers = nn.Sequential(*layers)
        self.joins = actions > 0

    def forward(self, batch: dict[str, th.Tensor]) -> dict[str, th.Tensor]:
        """Return the output of the last hidden layer in a dictionary with RLlib's key."""
        inputs = self.scale(batch[Columns.OBS])
        if self.joins:
            inputs = th.cat([inputs, batch[Columns.ACTIONS]], dim=-1)
        return {ENCODER_OUT: self.layers(inputs)}


class _SquashedHead(nn.Linear):
    """Output layer for means and bounded log standard deviations."""

    def forward(self, input: th.Tensor) -> th.Tensor:
        """Return the means and the log standard deviations (batch, 2 n)."""
        mean, log_std = super().forward(input).chunk(2, dim=-1)
        return th.cat([mean, log_std.clamp(*_LOG_STD)], dim=-1)


class SoftActorCritic(DefaultSACTorchRLModule):
    """A squashed Gaussian policy with actions in [−1, 1], and two action-value networks."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kwargs.pop("catalog_class", None)
        TorchRLModule.__init__(self, *args, **kwargs)  # skip RLlib's catalog of networks

    def setup(self) -> None:
        """Build the networks from the parts that RLlib's SAC expects."""
        config: Any = self.model_config
        actions = cast(spaces.Box, self.action_space).shape[0]
        layers = (config["net_arch"], config["activation_fn"])
        self.twin_q = True
        self.action_dist_cls = TorchSquashedGaussian
        self.pi_encoder = _Encoder(config["scale"], 0, *layers)
        self.pi = _SquashedHead(self.pi_encoder.width, 2 * actions)
        if not self.inference_only:
            self.qf_encoder = _Encoder(config["scale"], actions, *layers)
            self.qf = nn.Linear(self.qf_encoder.width, 1)
            self.qf_twin_encoder = _Encoder(config["scale"], actions, *layers)
            self.qf_twin = nn.Linear(self.qf_twin_encoder.width, 1)

    @property
    def mode(self) -> nn.Module:
        """Network that maps observations to the most probable action in [−1, 1]."""
        return _Mode(self)

    def act(self, observation: th.Tensor, generator: th.Generator) -> dict[str, th.Tensor]:
        """Sample actions for a batch of observations.

        Args:
            observation: Observations (batch, k).
            generator: Random number generator.

        Returns:
            Dictionary that contains the actions under RLlib's key for actions.
        """
        mean, log_std = self.pi(self.pi_encoder({Columns.OBS: observation})[ENCODER_OUT]).chunk(2, dim=-1)
        noise = th.randn(mean.shape, generator=generator)
        return {Columns.ACTIONS: th.tanh(mean + log_std.exp() * noise)}


class _Mode(nn.Module):
    """Network that maps observations to the mean of the policy's actions, squashed to [−1, 1]."""

    def __init__(self, module: SoftActorCritic) -> None:
        super().__init__()
        self.encoder, self.head = module.pi_encoder, module.pi

    def forward(self, observation: th.Tensor) -> th.Tensor:
        """Return actions (batch, n) in [−1, 1]."""
        return th.tanh(self.head(self.encoder({Columns.OBS: observation})[ENCODER_OUT]).chunk(2, dim=-1)[0])

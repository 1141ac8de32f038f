"""Network settings: ``policy_kwargs`` of stable-baselines3, with names instead of Python classes."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from frobs_algos.settings import ACTIVATIONS, Activation, Fraction, Settings, Widths

Extractor = Literal["FlattenExtractor", "CombinedExtractor", "NatureCNN", "SpatialSoftmax"]
Optimizer = Literal["Adam", "AdamW", "Adamax", "NAdam", "RAdam", "SGD", "RMSprop", "Adagrad", "Adadelta"]

_CROSSQ: dict[Literal["pi", "qf"], Widths] = {"pi": [256, 256], "qf": [1024, 1024]}


class NetworkConfig(Settings):
    """Network settings that every algorithm accepts.

    Attributes:
        net_arch: Widths of the hidden layers.
        activation_fn: Activation function between the layers.
        features_extractor_class: Features extractor in front of the layers, or None for the observation space's
            default. SpatialSoftmax reduces pictures to points, all others are those of stable-baselines3.
        normalize_images: Whether to divide pixels by 255.
        optimizer_class: PyTorch's name of the optimizer, or None for stable-baselines3's default, usually Adam.
        optimizer_kwargs: Other settings of the optimizer (``eps``, ``weight_decay``, ``betas``, …), or None for the
            defaults.
    """

    net_arch: Any = None
    activation_fn: Activation = "relu"
    features_extractor_class: Extractor | None = None
    normalize_images: bool = True
    optimizer_class: Optimizer | None = None
    optimizer_kwargs: dict[str, bool | float | list[float]] | None = None

    def to_kwargs(self) -> dict[str, Any]:
        """Return ``policy_kwargs`` for stable-baselines3."""
        from stable_baselines3.common import torch_layers
        from torch import nn, optim

        from frobs_algos_sb3.features import SpatialSoftmax

        kwargs = {key: value for key, value in self.model_dump().items() if value is not None}
        kwargs["activation_fn"] = getattr(nn, ACTIVATIONS[self.activation_fn])
        if self.features_extractor_class is not None:
            is_ours = self.features_extractor_class == "SpatialSoftmax"
            kwargs["features_extractor_class"] = (
                SpatialSoftmax if is_ours else getattr(torch_layers, self.features_extractor_class)
            )
        if self.optimizer_class is not None:
            kwargs["optimizer_class"] = getattr(optim, self.optimizer_class)
        return kwargs


class ActorCriticConfig(NetworkConfig):
    """Network settings of an on-policy algorithm.

    Attributes:
        net_arch: Widths of the hidden layers: a list for both networks, or a mapping with the keys ``pi`` and ``vf``.
        activation_fn: Activation function between the layers.
        share_features_extractor: Whether the actor and the critic share the features extractor.
        ortho_init: Whether the initial weights are orthogonal matrices.
        log_std_init: Logarithm of the initial standard deviation of the actions.
        full_std: Whether state-dependent exploration uses one standard deviation per pair of feature and action,
            instead of one per feature.
        use_expln: Whether to limit the growth of standard deviations in state-dependent exploration.
        squash_output: Whether to apply tanh to the actions in state-dependent exploration.
    """

    net_arch: Widths | dict[Literal["pi", "vf"], Widths] = Field(default=[64, 64])
    activation_fn: Activation = "tanh"
    share_features_extractor: bool = True
    ortho_init: bool = True
    log_std_init: float = 0.0
    full_std: bool = True
    use_expln: bool = False
    squash_output: bool = False


class RecurrentActorCriticConfig(ActorCriticConfig):
    """Network settings of a recurrent on-policy algorithm.

    Attributes:
        lstm_hidden_size: Width of the recurrent layers.
        n_lstm_layers: Number of recurrent layers.
        shared_lstm: Whether the critic uses the actor's recurrent layers, which requires ``enable_critic_lstm: false``.
        enable_critic_lstm: Whether the critic has its own recurrent layers.
    """

    lstm_hidden_size: PositiveInt = 256
    n_lstm_layers: PositiveInt = 1
    shared_lstm: bool = False
    enable_critic_lstm: bool = True

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.shared_lstm and (self.enable_critic_lstm or not self.share_features_extractor):
            raise ValueError("shared_lstm requires enable_critic_lstm: false and share_features_extractor: true")
        return self


class QNetworkConfig(NetworkConfig):
    """Network settings of DQN."""

    net_arch: Widths = Field(default=[64, 64])


class DeterministicConfig(NetworkConfig):
    """Network settings of DDPG and TD3.

    Attributes:
        net_arch: Widths of the hidden layers: a list for all networks, or a mapping with the keys ``pi`` and ``qf``.
        n_critics: Number of critics.
        share_features_extractor: Whether the actor and the critics share the features extractor.
    """

    net_arch: Widths | dict[Literal["pi", "qf"], Widths] = Field(default=[400, 300])
    n_critics: PositiveInt = 2
    share_features_extractor: bool = False


class SquashedGaussianConfig(DeterministicConfig):
    """Network settings of SAC.

    Attributes:
        log_std_init: Logarithm of the initial standard deviation in state-dependent exploration.
        use_expln: Whether to limit the growth of standard deviations in state-dependent exploration.
        clip_mean: Maximum absolute mean of the actions before tanh, in state-dependent exploration.
    """

    net_arch: Widths | dict[Literal["pi", "qf"], Widths] = Field(default=[256, 256])
    log_std_init: float = -3.0
    use_expln: bool = False
    clip_mean: NonNegativeFloat = 2.0


class QuantileConfig(SquashedGaussianConfig):
    """Network settings of TQC.

    Attributes:
        n_quantiles: Number of return quantiles per critic.
    """

    n_quantiles: PositiveInt = 25


class BatchNormConfig(SquashedGaussianConfig):
    """Network settings of CrossQ.

    Attributes:
        net_arch: Widths of the hidden layers: a list for all networks, or a mapping with the keys ``pi`` and ``qf``.
        batch_norm: Whether to normalize the inputs of the layers.
        batch_norm_momentum: Weight of the new batch in updates of the running statistics.
        batch_norm_eps: Constant added to variances.
        renorm_warmup_steps: Number of gradient steps before the running statistics are used.
    """

    net_arch: Widths | dict[Literal["pi", "qf"], Widths] = Field(default=_CROSSQ)
    batch_norm: bool = True
    batch_norm_momentum: Fraction = 0.01
    batch_norm_eps: PositiveFloat = 0.001
    renorm_warmup_steps: Annotated[int, Field(ge=0)] = 100_000

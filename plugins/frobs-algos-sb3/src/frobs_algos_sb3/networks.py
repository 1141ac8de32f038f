"""Settings of the networks: ``policy_kwargs`` of stable-baselines3, with names in the place of Python classes."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from frobs_algos_sb3.settings import Fraction, Settings

Widths = list[PositiveInt]
"""Of the hidden layers, from the first to the last."""

Activation = Literal["relu", "tanh", "elu", "selu", "gelu", "silu", "leaky_relu"]
Extractor = Literal["FlattenExtractor", "CombinedExtractor", "NatureCNN"]
Optimizer = Literal["Adam", "AdamW", "Adamax", "NAdam", "RAdam", "SGD", "RMSprop", "Adagrad", "Adadelta"]

_CROSSQ: dict[Literal["pi", "qf"], Widths] = {"pi": [256, 256], "qf": [1024, 1024]}
ACTIVATIONS = {
    "relu": "ReLU",
    "tanh": "Tanh",
    "elu": "ELU",
    "selu": "SELU",
    "gelu": "GELU",
    "silu": "SiLU",
    "leaky_relu": "LeakyReLU",
}


class NetworkConfig(Settings):
    """What the networks of every algorithm take.

    Attributes:
        net_arch: Widths of the hidden layers.
        activation_fn: Between the layers.
        features_extractor_class: What comes before the layers; None: what fits the observations.
        normalize_images: Whether pixels are divided by 255.
        optimizer_class: The optimiser, as PyTorch names it; None: stable-baselines3's choice, Adam as a rule.
        optimizer_kwargs: Its further settings: ``eps``, ``weight_decay``, ``betas``, …; None: stable-baselines3's.
    """

    net_arch: Any = None
    activation_fn: Activation = "relu"
    features_extractor_class: Extractor | None = None
    normalize_images: bool = True
    optimizer_class: Optimizer | None = None
    optimizer_kwargs: dict[str, bool | float | list[float]] | None = None

    def to_kwargs(self) -> dict[str, Any]:
        """Return ``policy_kwargs`` of stable-baselines3."""
        from stable_baselines3.common import torch_layers
        from torch import nn, optim

        kwargs = {key: value for key, value in self.model_dump().items() if value is not None}
        kwargs["activation_fn"] = getattr(nn, ACTIVATIONS[self.activation_fn])
        if self.features_extractor_class is not None:
            kwargs["features_extractor_class"] = getattr(torch_layers, self.features_extractor_class)
        if self.optimizer_class is not None:
            kwargs["optimizer_class"] = getattr(optim, self.optimizer_class)
        return kwargs


class ActorCriticConfig(NetworkConfig):
    """The networks of an on-policy algorithm.

    Attributes:
        net_arch: Widths of the hidden layers, for both networks or as a mapping (``pi``, ``vf``).
        activation_fn: Between the layers.
        share_features_extractor: Whether actor and critic share what comes before the layers.
        ortho_init: Whether weights start orthogonal.
        log_std_init: Logarithm of the standard deviation that exploration starts with.
        full_std: With state-dependent exploration: a deviation for each pair of feature and action, or each feature.
        use_expln: With state-dependent exploration: keep deviations from growing fast.
        squash_output: With state-dependent exploration: tanh on the actions.
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
    """The networks of a recurrent on-policy algorithm.

    Attributes:
        lstm_hidden_size: Width of the recurrent layers.
        n_lstm_layers: How many.
        shared_lstm: Whether the critic uses the actor's; then ``enable_critic_lstm`` must be false.
        enable_critic_lstm: Whether the critic has recurrent layers of its own.
    """

    lstm_hidden_size: PositiveInt = 256
    n_lstm_layers: PositiveInt = 1
    shared_lstm: bool = False
    enable_critic_lstm: bool = True

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.shared_lstm and (self.enable_critic_lstm or not self.share_features_extractor):
            raise ValueError("shared_lstm needs enable_critic_lstm: false and share_features_extractor: true")
        return self


class QNetworkConfig(NetworkConfig):
    """The network of DQN."""

    net_arch: Widths = Field(default=[64, 64])


class DeterministicConfig(NetworkConfig):
    """The networks of DDPG and TD3.

    Attributes:
        net_arch: Widths of the hidden layers, for all networks or as a mapping (``pi``, ``qf``).
        n_critics: How many critics.
        share_features_extractor: Whether actor and critics share what comes before the layers.
    """

    net_arch: Widths | dict[Literal["pi", "qf"], Widths] = Field(default=[400, 300])
    n_critics: PositiveInt = 2
    share_features_extractor: bool = False


class SquashedGaussianConfig(DeterministicConfig):
    """The networks of SAC.

    Attributes:
        log_std_init: With state-dependent exploration: logarithm of the deviation that it starts with.
        use_expln: With state-dependent exploration: keep deviations from growing fast.
        clip_mean: With state-dependent exploration: what the mean of the actions is clipped to before tanh.
    """

    net_arch: Widths | dict[Literal["pi", "qf"], Widths] = Field(default=[256, 256])
    log_std_init: float = -3.0
    use_expln: bool = False
    clip_mean: NonNegativeFloat = 2.0


class QuantileConfig(SquashedGaussianConfig):
    """The networks of TQC.

    Attributes:
        n_quantiles: Of the returns, for each critic.
    """

    n_quantiles: PositiveInt = 25


class BatchNormConfig(SquashedGaussianConfig):
    """The networks of CrossQ.

    Attributes:
        net_arch: Widths of the hidden layers, for all networks or as a mapping (``pi``, ``qf``).
        batch_norm: Whether the layers' inputs are normalised.
        batch_norm_momentum: How fast the statistics follow.
        batch_norm_eps: Added to variances.
        renorm_warmup_steps: Gradient steps before the running statistics are used.
    """

    net_arch: Widths | dict[Literal["pi", "qf"], Widths] = Field(default=_CROSSQ)
    batch_norm: bool = True
    batch_norm_momentum: Fraction = 0.01
    batch_norm_eps: PositiveFloat = 0.001
    renorm_warmup_steps: Annotated[int, Field(ge=0)] = 100_000

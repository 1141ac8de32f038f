"""Settings that the algorithms of stable-baselines3 share."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt

_LINEAR = re.compile(r"^lin_(.+)$")


def _check_schedule(value: float | str) -> float | str:
    if isinstance(value, str):
        match = _LINEAR.match(value)
        try:
            number = float(match[1]) if match else 0.0
        except ValueError:
            number = 0.0
        if number <= 0.0:
            raise ValueError("write a positive number, or 'lin_' and one for a value that falls linearly to 0")
    elif not value > 0.0:
        raise ValueError("must be positive")
    return value


Schedule = Annotated[float | str, Field(union_mode="left_to_right"), AfterValidator(_check_schedule)]
"""A positive number, or ``"lin_3e-4"``: one that falls linearly to 0 over the training."""

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


def schedule(value: float | str) -> float | Callable[[float], float]:
    """Return what stable-baselines3 takes as a schedule: of the remaining part of the training, from 1 to 0."""
    if isinstance(value, str):
        start = float(value.removeprefix("lin_"))
        return lambda remaining: start * remaining
    return value


class Settings(BaseModel):
    """Base class: frozen, and unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class PolicyConfig(Settings):
    """The networks.

    Attributes:
        net_arch: Widths of the hidden layers, for both networks or as a mapping (``pi``, ``vf``, ``qf``).
        activation_fn: Between the layers.
    """

    net_arch: list[PositiveInt] | dict[Literal["pi", "vf", "qf"], list[PositiveInt]] = [64, 64]
    activation_fn: Literal["relu", "tanh", "elu", "selu", "gelu", "silu", "leaky_relu"] = "tanh"

    def to_kwargs(self) -> dict[str, Any]:
        """Return ``policy_kwargs`` of stable-baselines3."""
        from torch import nn

        names = {name.lower(): name for name in ("ReLU", "Tanh", "ELU", "SELU", "GELU", "SiLU")}
        names["leaky_relu"] = "LeakyReLU"
        return {**self.model_dump(), "activation_fn": getattr(nn, names[self.activation_fn])}


class ActorCriticConfig(PolicyConfig):
    """The networks of an on-policy algorithm.

    Attributes:
        log_std_init: Logarithm of the standard deviation that exploration starts with.
        ortho_init: Whether weights start orthogonal.
    """

    log_std_init: float = 0.0
    ortho_init: bool = True


class SB3Config(Settings):
    """What every algorithm takes.

    Attributes:
        learning_rate: Of every optimiser.
        gamma: Discount per control step.
        scale_observation: Whether observations are multiplied by what the task suggests, where it suggests something
            and they are not normalised.
        normalize_observation: Whether observations are scaled by their running mean and deviation.
        normalize_reward: Whether rewards are scaled by the running deviation of the discounted return.
        clip_observation: What scaled observations are clipped to.
        clip_reward: What scaled rewards are clipped to.
        torch_threads: Threads of PyTorch. One is fastest for small networks, and does not fight with the simulator's.
        device: Where the networks are: ``cpu``, ``cuda``, …
    """

    learning_rate: Schedule = 3e-4
    gamma: Fraction = 0.99
    scale_observation: bool = True
    normalize_observation: bool = False
    normalize_reward: bool = False
    clip_observation: PositiveFloat = 10.0
    clip_reward: PositiveFloat = 10.0
    torch_threads: PositiveInt = 1
    device: str = "cpu"

    def model_kwargs(self) -> dict[str, Any]:
        """Return the keywords of the algorithm's class in stable-baselines3."""
        return {key: value for key, value in self.model_dump().items() if key not in _OURS} | {
            "learning_rate": schedule(self.learning_rate)
        }


_OURS = (
    "scale_observation",
    "normalize_observation",
    "normalize_reward",
    "clip_observation",
    "clip_reward",
    "torch_threads",
)

"""Settings of sbx's algorithms, which reject settings of ``frobs-algos-sb3`` that sbx does not support."""

from __future__ import annotations

from functools import partial
from typing import Any, ClassVar, Self

from pydantic import model_validator

from frobs_algos_sb3.config import SB3Config
from frobs_algos_sb3.networks import NetworkConfig

_OPTIMIZERS = {"Adam": "adam", "AdamW": "adamw", "Adamax": "adamax", "NAdam": "nadam", "RAdam": "radam", "SGD": "sgd"}
_OPTIMIZERS |= {"RMSprop": "rmsprop", "Adagrad": "adagrad", "Adadelta": "adadelta"}
_ALL = ("device", "policy_kwargs.features_extractor_class", "policy_kwargs.normalize_images")


class JaxConfig(SB3Config):
    """Settings that all of sbx's algorithms accept.

    Attributes:
        unsupported: Settings of ``frobs-algos-sb3`` that sbx does not support. These settings, and those of the networks
            that its policies do not accept, must keep their defaults.
    """

    unsupported: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="after")
    def _check_support(self) -> Self:
        unused = getattr(self.policy_kwargs, "unused", ())
        for key in (*_ALL, *self.unsupported, *(f"policy_kwargs.{name}" for name in unused)):
            owner: Any = self
            *path, name = key.split(".")
            for part in path:
                owner = getattr(owner, part)
            default = type(owner).model_fields[name].get_default(call_default_factory=True)
            if getattr(owner, name) != default:
                raise ValueError(f"{key} must keep its default {default!r}, because sbx does not support this setting")
        return self

    def model_kwargs(self) -> dict[str, Any]:
        """Return the keyword arguments for the algorithm's class in sbx."""
        kwargs = super().model_kwargs()
        return {key: value for key, value in kwargs.items() if key not in (*_ALL, *self.unsupported)}


class JaxNetworkConfig(NetworkConfig):
    """Settings of the flax networks and the optax optimizer.

    The keys of ``optimizer_kwargs`` are the argument names of optax, such as ``b1`` and ``eps``.

    Attributes:
        unused: Settings that sbx's policies do not accept.
        fixed_rate: Whether sbx builds the optimizer with a fixed learning rate unless ``optimizer_class`` is wrapped.
    """

    unused: ClassVar[tuple[str, ...]] = ()
    fixed_rate: ClassVar[bool] = False

    def to_kwargs(self) -> dict[str, Any]:
        """Return sbx's ``policy_kwargs``."""
        import optax
        from flax import linen

        left_out = ("features_extractor_class", "normalize_images", *self.unused)
        kwargs = {key: value for key, value in self.model_dump().items() if value is not None and key not in left_out}
        name = self.activation_fn
        # By default, flax uses an approximation of GELU, but PyTorch uses the exact function.
        kwargs["activation_fn"] = partial(linen.gelu, approximate=False) if name == "gelu" else getattr(linen, name)
        if self.optimizer_class is not None:
            kwargs["optimizer_class"] = getattr(optax, _OPTIMIZERS[self.optimizer_class])
        if self.fixed_rate:
            kwargs["optimizer_class"] = optax.inject_hyperparams(kwargs.get("optimizer_class", optax.adam))
        return kwargs

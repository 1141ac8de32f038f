"""The classes to which a model file may refer: algorithms, policies and their parts."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.sb2_compat.rmsprop_tf_like import RMSpropTFLike
from stable_baselines3.common.torch_layers import CombinedExtractor, FlattenExtractor, NatureCNN
from torch import nn

from frobs_algos_sb3.model_files.text import Unreadable, class_name, constructed_class

ALGORITHMS: Mapping[str, str] = {
    "ppo": "stable_baselines3:PPO",
    "a2c": "stable_baselines3:A2C",
    "ddpg": "stable_baselines3:DDPG",
    "dqn": "stable_baselines3:DQN",
    "sac": "stable_baselines3:SAC",
    "td3": "stable_baselines3:TD3",
    "tqc": "sb3_contrib:TQC",
    "recurrent_ppo": "sb3_contrib:RecurrentPPO",
    "crossq": "sb3_contrib:CrossQ",
}
"""Class of each algorithm as ``"module:class"``, by algorithm name."""

_POLICIES: Mapping[str, tuple[str, ...]] = {
    "stable_baselines3.common.policies": ("ActorCriticPolicy", "ActorCriticCnnPolicy", "MultiInputActorCriticPolicy"),
    "stable_baselines3.sac.policies": ("SACPolicy", "CnnPolicy", "MultiInputPolicy"),
    "stable_baselines3.td3.policies": ("TD3Policy", "CnnPolicy", "MultiInputPolicy"),
    "stable_baselines3.dqn.policies": ("DQNPolicy", "CnnPolicy", "MultiInputPolicy"),
    "sb3_contrib.tqc.policies": ("TQCPolicy", "CnnPolicy", "MultiInputPolicy"),
    "sb3_contrib.crossq.policies": ("CrossQPolicy",),
    "sb3_contrib.common.recurrent.policies": (
        "RecurrentActorCriticPolicy",
        "RecurrentActorCriticCnnPolicy",
        "RecurrentMultiInputActorCriticPolicy",
    ),
}

_OF_MODULE = {
    "stable_baselines3.sac.policies": "sac",
    "stable_baselines3.dqn.policies": "dqn",
    "sb3_contrib.tqc.policies": "tqc",
    "sb3_contrib.crossq.policies": "crossq",
    "sb3_contrib.common.recurrent.policies": "recurrent_ppo",
}


def _by_path(*classes: type) -> dict[str, type]:
    return {f"{cls.__module__}.{cls.__qualname__}": cls for cls in classes}


_CLASSES: Mapping[str, Mapping[str, type]] = {
    "activation_fn": _by_path(
        nn.ReLU, nn.Tanh, nn.ELU, nn.SELU, nn.GELU, nn.SiLU, nn.LeakyReLU, nn.Sigmoid, nn.Softplus, nn.Mish, nn.CELU,
        nn.ReLU6, nn.Hardtanh, nn.Hardswish, nn.Softsign, nn.Identity,
    ),
    "optimizer_class": _by_path(
        th.optim.Adam, th.optim.AdamW, th.optim.SGD, th.optim.RMSprop, th.optim.Adagrad, th.optim.Adadelta, th.optim.Adamax,
        th.optim.NAdam, th.optim.RAdam, RMSpropTFLike,
    ),
    "features_extractor_class": _by_path(FlattenExtractor, NatureCNN, CombinedExtractor),
}  # fmt: skip


def algorithm_class(name: str) -> type[BaseAlgorithm]:
    """Return the class of an algorithm, or raise Unreadable if sb3-contrib is not installed."""
    module, _, attribute = ALGORITHMS[name].partition(":")
    try:
        cls: type[BaseAlgorithm] = getattr(import_module(module), attribute)
    except ImportError as error:
        raise Unreadable(
            f"algorithm '{name}' requires {module}; install it with 'pip install {module.replace('_', '-')}'"
        ) from error
    return cls


def identify(data: Mapping[str, Any]) -> str | None:
    """Return the name of the algorithm that saved the attributes ``data``, or None if it cannot be identified.

    The name is inferred from the attributes, because files do not contain it.
    """
    policy = data.get("policy_class")
    module = policy.get("__module__") if isinstance(policy, dict) else None
    if module in _OF_MODULE:
        return _OF_MODULE[module]
    if "policy_delay" in data:
        kwargs = data.get("policy_kwargs")
        single = isinstance(kwargs, dict) and kwargs.get("n_critics") == 1
        return "ddpg" if single and data["policy_delay"] == 1 and data.get("target_noise_clip") == 0.0 else "td3"
    if "exploration_fraction" in data:
        return "dqn"
    if "target_entropy" in data:
        return "sac"
    if "clip_range" in data:
        return "ppo"
    return "a2c" if "gae_lambda" in data else None


def policy_class(value: Any) -> type[Any]:
    """Return the policy class named in a pickle's readable text, or raise Unreadable if the class is unknown.

    The text contains the name of the class's module, and the name of the class as part of the constructor's name.
    """
    module = str(value.get("__module__") if isinstance(value, dict) else None)
    name = constructed_class(value)
    if name not in _POLICIES.get(module, ()):
        full_name = f"{module}.{name}" if name else module
        raise Unreadable(f"{full_name} is not a policy class of stable-baselines3 or sb3-contrib")
    result: type[Any] = getattr(import_module(module), name)
    return result


def policy_argument_class(field: str, written: Any) -> type[Any]:
    """Return the class named in a ``policy_kwargs`` field, such as ``"<class 'torch.nn.modules.activation.ReLU'>"``."""
    classes = _CLASSES[field]
    name = class_name(written)
    if name not in classes:
        known = ", ".join(cls.__name__ for cls in classes.values())
        raise Unreadable(f"{field} {name or written!r} is not one of {known}")
    return classes[name]

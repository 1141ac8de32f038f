"""The settings in FRobs_RL's YAML files, under the key ``model_params``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveInt, field_validator

from frobs_core.util.errors import ConfigFileError, ConfigurationError, nearest
from frobs_core.util.validation import validate
from frobs_core.util.yaml import ConfigMapping, merge
from frobs_rl_compat.training.blocks import BLOCKS, WITH_NOISE, WITH_SDE, Block, Strict

ROOT = "model_params"
"""Root key of the files."""

ACTIVATIONS = {"relu": "ReLU", "tanh": "Tanh", "elu": "ELU", "selu": "SELU"}
"""PyTorch's name of each activation function, by its name in the file."""


class PolicyParams(Strict):
    """Network settings of a new model, used if ``use_custom_policy`` is true.

    Attributes:
        net_arch: Widths of the hidden layers.
        activation_fn: Name of the activation function between the layers, in upper or lower case.
        features_extractor_class: Features extractor in front of the layers.
        optimizer_class: Name of a PyTorch optimizer.
    """

    net_arch: list[PositiveInt] | dict[Literal["pi", "vf", "qf"], list[PositiveInt]] = Field(default=[400, 300])
    activation_fn: Literal["relu", "tanh", "elu", "selu"] = "relu"
    features_extractor_class: Literal["FlattenExtractor", "BaseFeaturesExtractor", "CombinedExtractor"] = (
        "FlattenExtractor"
    )
    optimizer_class: Literal["Adam", "SGD", "RMSprop", "Adagrad", "Adadelta"] = "Adam"

    @field_validator("activation_fn", mode="before")
    @classmethod
    def _lower(cls, value: Any) -> Any:
        return value.lower() if isinstance(value, str) else value

    def to_kwargs(self) -> dict[str, Any]:
        """Return ``policy_kwargs`` for stable-baselines3, or raise ConfigurationError for an abstract extractor."""
        from stable_baselines3.common import torch_layers
        from torch import nn, optim

        if self.features_extractor_class == "BaseFeaturesExtractor":
            raise ConfigurationError(
                "features_extractor_class cannot be BaseFeaturesExtractor, which is abstract; use FlattenExtractor, "
                "or CombinedExtractor for Dict observations."
            )
        return {
            "net_arch": self.net_arch,
            "activation_fn": getattr(nn, ACTIVATIONS[self.activation_fn]),
            "features_extractor_class": getattr(torch_layers, self.features_extractor_class),
            "optimizer_class": getattr(optim, self.optimizer_class),
        }


class SdeParams(Strict):
    """Settings of state-dependent exploration.

    Attributes:
        sde_sample_freq: Number of steps after which a new noise matrix is drawn, or −1 to draw one only at the start of
            an iteration.
        use_sde_at_warmup: Whether to use state-dependent exploration even before learning starts (SAC).
    """

    sde_sample_freq: int = Field(default=-1, ge=-1)
    use_sde_at_warmup: bool = False


class ActionNoiseParams(Strict):
    """Gaussian noise on actions in [−1, 1], with the same parameters for all components.

    Attributes:
        mean: Mean of the noise.
        sigma: Standard deviation of the noise.
    """

    mean: float = 0.0
    sigma: NonNegativeFloat = 0.01


class ModelParams(Strict):
    """Settings under ``model_params``, except the algorithm's own block.

    Attributes:
        training_steps: Number of steps per call of ``train``.
        save_freq: Number of steps between saves during training, or 0 to save no intermediate models.
        save_prefix: Name prefix of the models that are saved during training.
        trained_model_name: Name of the model that is saved at the end of training.
        save_replay_buffer: Whether to save the replay buffer next to the model at the end of training.
        load_model: Whether to continue training the model ``model_name``.
        model_name: Name of a model in the model folder.
        log_folder: Name of the log folder of this training run.
        log_interval: Number of episodes (iterations for PPO and A2C) between log entries.
        reset_num_timesteps: Whether each call of ``train`` counts steps from 0.
        use_custom_policy: Whether to use ``policy_params`` for new models.
        policy_params: Settings of the networks.
        use_sde: Whether to use state-dependent exploration (PPO, A2C, SAC).
        sde_params: Settings of state-dependent exploration.
        use_action_noise: Whether to add noise to actions (DDPG, TD3, SAC without ``use_sde``).
        action_noise: Settings of the action noise.
    """

    training_steps: PositiveInt = 5000
    save_freq: NonNegativeInt = 1000
    save_prefix: str
    trained_model_name: str = Field("trained_model", min_length=1)
    save_replay_buffer: bool = False
    load_model: bool = False
    model_name: str
    log_folder: str = Field(min_length=1)
    log_interval: PositiveInt = 4
    reset_num_timesteps: bool = False
    use_custom_policy: bool = False
    policy_params: PolicyParams = PolicyParams()
    use_sde: bool = False
    sde_params: SdeParams = SdeParams()
    use_action_noise: bool = False
    action_noise: ActionNoiseParams = ActionNoiseParams()


class FileSettings(Strict):
    """Settings from a file for one algorithm. ``unused`` lists the keys that do not affect the algorithm."""

    algorithm: str
    params: ModelParams
    block: Block
    unused: tuple[str, ...] = ()

    def sde(self) -> dict[str, Any]:
        """Return keyword arguments for state-dependent exploration, or ``{}`` if the algorithm does not support it."""
        if self.algorithm not in WITH_SDE:
            return {}
        params = self.params.sde_params.model_dump()
        if self.algorithm != "sac":
            del params["use_sde_at_warmup"]
        return {"use_sde": self.params.use_sde, **params}

    def has_action_noise(self) -> bool:
        """Return whether noise is added to actions. State-dependent exploration replaces this noise."""
        return self.params.use_action_noise and not self.sde().get("use_sde", False)


def algorithms_in(mapping: Mapping[str, Any]) -> list[str]:
    """Return the algorithms that have a block in a file."""
    params = mapping.get(ROOT)
    return [name for name in BLOCKS if isinstance(params, Mapping) and f"{name}_params" in params]


def read_settings(mapping: Mapping[str, Any], algorithm: str, path: Path | str = "the parameters") -> FileSettings:
    """Validate a file for one algorithm and add FRobs_RL's defaults. Errors contain the file's ``path``.

    Raises:
        ConfigFileError: ``model_params`` or the algorithm's block is missing, or a key or value is invalid.
        ConfigurationError: A key or value is invalid, and the mapping was not read from a file.
    """
    given = mapping.get(ROOT)
    if not isinstance(given, Mapping):
        similar = nearest(ROOT, mapping)
        instead = f" instead of '{similar}'" if similar and ROOT not in mapping else ""
        raise ConfigFileError(path, None, f"a mapping is required under the root key '{ROOT}'{instead}.")
    block_name = f"{algorithm}_params"
    if not isinstance(given.get(block_name), Mapping):
        blocks = [f"{name}_params" for name in algorithms_in(mapping)]
        similar = nearest(block_name, given) if not blocks else None
        text = f"it has {', '.join(blocks)}" if blocks else f"'{similar}' may be a misspelling" if similar else "add it"
        raise ConfigFileError(path, None, f"has no mapping '{block_name}' under '{ROOT}'; {text}.")
    others = tuple(f"{name}_params" for name in algorithms_in(mapping) if name != algorithm)
    origins = given.origins if isinstance(given, ConfigMapping) else {}
    shared = {key: value for key, value in given.items() if key not in (block_name, *others)}
    owner = f"'{ROOT}'"
    params = validate(ModelParams, merge(_defaults(algorithm), ConfigMapping(shared, origins)), owner)
    block = validate(BLOCKS[algorithm], given[block_name], f"'{block_name}'")
    return FileSettings(algorithm=algorithm, params=params, block=block, unused=(*_unused(shared, algorithm), *others))


def _defaults(algorithm: str) -> dict[str, Any]:
    return {
        "save_prefix": f"{algorithm}_model",
        "model_name": f"{algorithm}_model_5000_steps",
        "log_folder": f"{algorithm.upper()}_1",
        "use_sde": algorithm == "sac",
        "use_action_noise": algorithm in WITH_NOISE,
    }


def _unused(given: Mapping[str, Any], algorithm: str) -> list[str]:
    """Return the keys of a file that have no effect on the algorithm."""
    unused = []
    if algorithm not in WITH_SDE:
        unused += [key for key in ("use_sde", "sde_params") if key in given]
    if algorithm not in WITH_NOISE:
        unused += [key for key in ("use_action_noise", "action_noise") if key in given]
    return unused

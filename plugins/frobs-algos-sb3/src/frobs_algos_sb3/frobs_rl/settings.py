"""FRobs_RL's YAML files: the key ``model_params`` and all that stands under it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveInt, field_validator

from frobs_algos_sb3.frobs_rl.blocks import BLOCKS, WITH_NOISE, WITH_SDE, Block, Strict
from frobs_core.errors import ConfigFileError, ConfigurationError, nearest
from frobs_core.validation import validate
from frobs_core.yaml import ConfigMapping, merge

ROOT = "model_params"
"""The root key of the files."""

ACTIVATIONS = {"relu": "ReLU", "tanh": "Tanh", "elu": "ELU", "selu": "SELU"}
"""Name in the file to name in PyTorch."""


class PolicyParams(Strict):
    """The networks of a new model; used where ``use_custom_policy`` says so.

    Attributes:
        net_arch: Widths of the hidden layers.
        activation_fn: Between them; upper or lower case.
        features_extractor_class: What comes before them.
        optimizer_class: Of PyTorch.
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
        """Return ``policy_kwargs`` of stable-baselines3; ConfigurationError: the features extractor is abstract."""
        from stable_baselines3.common import torch_layers
        from torch import nn, optim

        if self.features_extractor_class == "BaseFeaturesExtractor":
            raise ConfigurationError(
                "features_extractor_class BaseFeaturesExtractor is only the base class of the others; use FlattenExtractor, "
                "or CombinedExtractor for observations that are a Dict."
            )
        return {
            "net_arch": self.net_arch,
            "activation_fn": getattr(nn, ACTIVATIONS[self.activation_fn]),
            "features_extractor_class": getattr(torch_layers, self.features_extractor_class),
            "optimizer_class": getattr(optim, self.optimizer_class),
        }


class SdeParams(Strict):
    """State-dependent exploration.

    Attributes:
        sde_sample_freq: Steps between two draws of its matrix; −1: at the start of an iteration.
        use_sde_at_warmup: Whether it explores before learning starts, too (SAC).
    """

    sde_sample_freq: int = Field(default=-1, ge=-1)
    use_sde_at_warmup: bool = False


class ActionNoiseParams(Strict):
    """Gaussian noise on actions in [−1, 1], the same for each component.

    Attributes:
        mean: Its mean.
        sigma: Its standard deviation.
    """

    mean: float = 0.0
    sigma: NonNegativeFloat = 0.01


class ModelParams(Strict):
    """What stands under ``model_params``, without the algorithm's own block.

    Attributes:
        training_steps: How long ``train`` trains.
        save_freq: Steps between models that are saved meanwhile; 0: none.
        save_prefix: Of their names.
        trained_model_name: Name of the model that is saved at the end.
        save_replay_buffer: Whether the replay buffer is saved beside it.
        load_model: Whether training goes on from ``model_name``.
        model_name: A model in the folder of the models.
        log_folder: Name of the folder of this training's logs.
        log_interval: Episodes between logs; of PPO and A2C: iterations.
        reset_num_timesteps: Whether each training counts its steps from 0.
        use_custom_policy: Whether ``policy_params`` counts; only for new models.
        policy_params: The networks.
        use_sde: Whether to explore by state-dependent noise (PPO, A2C, SAC).
        sde_params: How.
        use_action_noise: Whether to add noise to actions (DDPG, TD3, SAC without ``use_sde``).
        action_noise: Which.
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
    """The settings of a file for one algorithm; ``unused`` lists keys without a meaning for it."""

    algorithm: str
    params: ModelParams
    block: Block
    unused: tuple[str, ...] = ()

    def sde(self) -> dict[str, Any]:
        """Return the keywords of state-dependent exploration; none if the algorithm does not support it."""
        if self.algorithm not in WITH_SDE:
            return {}
        params = self.params.sde_params.model_dump()
        if self.algorithm != "sac":
            del params["use_sde_at_warmup"]
        return {"use_sde": self.params.use_sde, **params}

    def has_action_noise(self) -> bool:
        """Return whether noise is added to actions; state-dependent exploration replaces it."""
        return self.params.use_action_noise and not self.sde().get("use_sde", False)


def algorithms_in(mapping: Mapping[str, Any]) -> list[str]:
    """Return the algorithms whose blocks a file has."""
    params = mapping.get(ROOT)
    return [name for name in BLOCKS if isinstance(params, Mapping) and f"{name}_params" in params]


def read_settings(mapping: Mapping[str, Any], algorithm: str, path: Path | str = "the parameters") -> FileSettings:
    """Check a file for one algorithm and fill in FRobs_RL's defaults; ``path`` is the name of the file in errors.

    Raises:
        ConfigFileError: ``model_params`` or the algorithm's block is missing, or a key or value cannot be used.
        ConfigurationError: The same, if the mapping is not from a file.
    """
    given = mapping.get(ROOT)
    if not isinstance(given, Mapping):
        similar = nearest(ROOT, mapping)
        instead = f" instead of '{similar}'" if similar and ROOT not in mapping else ""
        raise ConfigFileError(path, None, f"has no mapping '{ROOT}'; write it{instead} as the root key.")
    block_name = f"{algorithm}_params"
    if not isinstance(given.get(block_name), Mapping):
        found = [f"{name}_params" for name in algorithms_in(mapping)]
        similar = nearest(block_name, given) if not found else None
        text = f"it has {', '.join(found)}" if found else f"did you mean it by '{similar}'?" if similar else "add it"
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
    """Return the keys of a file that the algorithm has no use for."""
    found = []
    if algorithm not in WITH_SDE:
        found += [key for key in ("use_sde", "sde_params") if key in given]
    if algorithm not in WITH_NOISE:
        found += [key for key in ("use_action_noise", "action_noise") if key in given]
    return found

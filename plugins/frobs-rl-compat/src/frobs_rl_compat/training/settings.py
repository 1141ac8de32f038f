"""The settings in FRobs_RL's YAML files, under the key ``model_params``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, PositiveInt, field_validator

from frobs_algos_sb3.a2c import A2CConfig
from frobs_algos_sb3.config import SampleFrequency, SB3Config
from frobs_algos_sb3.ddpg import DDPGConfig
from frobs_algos_sb3.dqn import DQNConfig
from frobs_algos_sb3.noise import ActionNoiseConfig
from frobs_algos_sb3.ppo import PPOConfig
from frobs_algos_sb3.sac import SACConfig
from frobs_algos_sb3.td3 import TD3Config
from frobs_core.util.errors import ConfigFileError, ConfigurationError, UnknownParameterError, nearest
from frobs_core.util.validation import validate
from frobs_core.util.yaml import ConfigMapping, find_origin, load_yaml, merge
from frobs_rl_compat.training.config_files import DEFAULTS

ROOT = "model_params"
"""Root key of the files."""

CONFIGS: Mapping[str, type[SB3Config]] = {
    "ppo": PPOConfig,
    "a2c": A2CConfig,
    "ddpg": DDPGConfig,
    "dqn": DQNConfig,
    "sac": SACConfig,
    "td3": TD3Config,
}
"""Settings class of each algorithm, by algorithm name. In the YAML file, its settings are in ``<name>_params``."""

WITH_SDE = ("ppo", "a2c", "sac")
"""Algorithms that support state-dependent exploration."""

WITH_NOISE = ("ddpg", "td3", "sac")
"""Algorithms that support action noise."""


class Strict(BaseModel):
    """Base class of immutable settings that reject unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


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

    def network_settings(self) -> dict[str, Any]:
        """Return the settings of the networks in a run configuration."""
        if self.features_extractor_class == "BaseFeaturesExtractor":
            raise ConfigurationError(
                "features_extractor_class cannot be BaseFeaturesExtractor, which is abstract; use FlattenExtractor, "
                "or CombinedExtractor for Dict observations."
            )
        is_default = self.features_extractor_class == "FlattenExtractor"
        return self.model_dump(exclude={"features_extractor_class"} if is_default else None)


class SdeParams(Strict):
    """Settings of state-dependent exploration."""

    sde_sample_freq: SampleFrequency = -1
    use_sde_at_warmup: bool = False  # whether to use it even before learning starts (SAC)


class TrainFrequency(Strict):
    """Interval between two training rounds of an off-policy algorithm, as a number of steps or episodes."""

    freq: PositiveInt
    unit: Literal["step", "episode"]


class ModelParams(Strict):
    """Settings under ``model_params``, except the algorithm's own settings. The default files contain the defaults."""

    training_steps: PositiveInt  # per call of ``train``
    save_freq: NonNegativeInt  # steps between saves during training, or 0 to save no intermediate models
    save_prefix: str  # name prefix of the models that are saved during training
    trained_model_name: str = Field(min_length=1)  # name of the model that is saved at the end of training
    save_replay_buffer: bool  # whether to save the replay buffer next to the model at the end of training
    load_model: bool  # whether to continue training the model ``model_name``
    model_name: str  # name of a model in the model folder
    log_folder: str = Field(min_length=1)  # name of the log folder of this training run
    log_interval: PositiveInt  # episodes (iterations for PPO and A2C) between log entries
    reset_num_timesteps: bool  # whether each call of ``train`` counts steps from 0
    use_custom_policy: bool  # whether to use ``policy_params`` for new models
    policy_params: PolicyParams
    use_sde: bool = False  # whether to use state-dependent exploration (PPO, A2C, SAC)
    sde_params: SdeParams = SdeParams()
    use_action_noise: bool = False  # whether to add noise to actions (DDPG, TD3, SAC without ``use_sde``)
    action_noise: ActionNoiseConfig = ActionNoiseConfig()


@dataclass(frozen=True)
class FileSettings:
    """Settings from a file for one algorithm."""

    algorithm: str
    params: ModelParams  # settings that do not belong to the algorithm
    config: SB3Config  # settings of the algorithm, of which those that FRobs_RL does not have are unset
    unused: tuple[str, ...] = ()  # keys in the file that do not affect the algorithm

    def run_settings(self) -> dict[str, Any]:
        """Return the algorithm's settings as a run configuration contains them."""
        return self.config.model_dump(mode="json", exclude_unset=True)

    def model_kwargs(self) -> dict[str, Any]:
        """Return keyword arguments of the algorithm's class in stable-baselines3, except for the action noise."""
        settings, kwargs = self.run_settings(), self.config.model_kwargs()
        if "policy_kwargs" in settings:
            kwargs["policy_kwargs"] = {key: kwargs["policy_kwargs"][key] for key in settings["policy_kwargs"]}
        return {key: kwargs[key] for key in settings if key in kwargs}


def algorithms_in(mapping: Mapping[str, Any]) -> list[str]:
    """Return the algorithms that have a block in a file."""
    params = mapping.get(ROOT)
    return [name for name in CONFIGS if isinstance(params, Mapping) and f"{name}_params" in params]


def read_settings(mapping: Mapping[str, Any], algorithm: str, path: Path | str = "the parameters") -> FileSettings:
    """Validate a file for one algorithm and add FRobs_RL's defaults. Errors contain the file's ``path``."""
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
    defaults = load_yaml(DEFAULTS / f"{algorithm}_config.yaml")[ROOT]
    merged = merge(defaults, given)
    block = merged.pop(block_name)
    for name in others:
        del merged[name]
    for key in block:
        if key not in defaults[block_name]:
            error = UnknownParameterError(f"'{block_name}'", key, defaults[block_name])
            origin = find_origin(block, [key])
            raise ConfigFileError(*origin, str(error)) if origin else error
    params = validate(ModelParams, merged, f"'{ROOT}'")
    config = validate(CONFIGS[algorithm], _translate(algorithm, params, block), f"'{block_name}'")
    unused = (*_unused(given, algorithm), *others)
    return FileSettings(algorithm=algorithm, params=params, config=config, unused=unused)


def _translate(algorithm: str, params: ModelParams, block: ConfigMapping) -> ConfigMapping:
    """Return the algorithm's settings in a run configuration, which disable the scaling of observations."""
    config = merge(block, {"scale_observation": False})
    if "train_freq" in block:
        frequency = validate(TrainFrequency, block["train_freq"], f"'train_freq' of '{algorithm}_params'")
        config["train_freq"] = {"frequency": frequency.freq, "unit": frequency.unit}
    if algorithm in WITH_SDE:
        sde = params.sde_params.model_dump(exclude=None if algorithm == "sac" else {"use_sde_at_warmup"})
        config |= {"use_sde": params.use_sde, **sde}
    if algorithm in WITH_NOISE:  # state-dependent exploration replaces action noise
        has_noise = params.use_action_noise and not config.get("use_sde")
        config["action_noise"] = params.action_noise.model_dump(include={"mean", "sigma"}) if has_noise else None
    if params.use_custom_policy:
        config["policy_kwargs"] = params.policy_params.network_settings()
    return config


def _unused(given: Mapping[str, Any], algorithm: str) -> list[str]:
    """Return the keys of a file that have no effect on the algorithm."""
    unused = []
    if algorithm not in WITH_SDE:
        unused += [key for key in ("use_sde", "sde_params") if key in given]
    if algorithm not in WITH_NOISE:
        unused += [key for key in ("use_action_noise", "action_noise") if key in given]
    return unused

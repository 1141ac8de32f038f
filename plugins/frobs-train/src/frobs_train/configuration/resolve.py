"""Resolve the configuration of a run."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, cast

from frobs_cli.errors import CommandLineError
from frobs_cli.model_options import ROBOT_FLAGS
from frobs_core import plugins
from frobs_core.kernel.robot_file import absolute_files
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.plugins.registry import bare_id, environments
from frobs_core.sensing.randomization import read_settings
from frobs_core.util.errors import (
    ConfigFileError,
    ConfigurationError,
    ConflictingOptionsError,
    MissingSettingError,
    nearest,
)
from frobs_core.util.plain import spell_numbers, to_json
from frobs_core.util.validation import validate
from frobs_core.util.yaml import ConfigMapping, find_origin, load_yaml_text, load_yaml_value, merge
from frobs_train.configuration.components import check_components
from frobs_train.configuration.config import OWNER, RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.configuration.other_layouts import read_config_file
from frobs_train.environments import check_environment, with_fixed_keywords

_QUOTED_NUMBER = r'"(-?\.inf|\.nan)"'


def resolve_config(
    environment: str | None = None,
    *,
    file: Path | str | None = None,
    flags: Mapping[str, Any] | None = None,
    settings: Sequence[str] = (),
    check_parts: bool = False,
    trains: bool = True,
) -> RunConfig:
    """Resolve a configuration from tuned settings, a file, flags and individual settings.

    In order of increasing precedence, the sources are the default algorithm of the ID, the settings for the ID in the
    algorithm's record, the file, the flags, and the individual settings. If the file has another layout, which a
    :class:`.ConfigLayoutRecord` declares, the file is translated and the tuned settings are ignored. The file may have
    a section ``controllers`` with one mapping per controller. Only the mapping of the chosen controller is used.

    Args:
        environment: Gymnasium ID. Defaults to the ID in the file.
        file: YAML file with the keys of :class:`RunConfig`.
        flags: Mapping from keys of :class:`RunConfig` to values. The keys ``robot``, ``tcp``, ``gripper``, ``attach``,
            ``base``, ``simulator``, ``controller``, ``object``, ``object_mass`` and ``object_scale`` of
            ``environment_kwargs`` are also accepted, and ``num_envs`` as a text such as ``"mujoco=48,pybullet=16"``.
            Values of None are ignored.
        settings: Assignments of YAML values to dotted keys, such as ``"algorithm_config.n_steps=16"``.
        check_parts: Whether to check the environment's parts first, because an algorithm's library is slow to import.
        trains: Whether the algorithm must be installed. If it is not, there are no tuned settings.

    Returns:
        The configuration, including all defaults of the algorithm. If the robot is a model file,
        ``environment_kwargs`` contains the gripper that was found and the settings that were fitted to the robot, so
        that all later uses of the run have the same environment.

    Raises:
        UnknownNameError: No algorithm has this name.
        UnknownParameterError: A key is unknown.
        ConfigurationError: A value is invalid.
        ConfigFileError: The file contains an unknown key or an invalid value.
    """
    from_flags = _from_flags(environment, flags or {})
    from_settings = merge(*(read_setting(setting) for setting in settings))
    _check_sections(from_settings)
    from_file, translated = ConfigMapping(), False
    if file is not None:
        from_file, translated = read_config_file(file, merge(from_flags, from_settings).get("algorithm"))
    if isinstance(from_flags.get("num_envs"), Mapping):  # it replaces the simulators of the file
        from_file.pop("num_envs", None)
    chosen = merge(from_file, from_flags, from_settings)
    id = str(chosen.get("environment", ""))
    usual = {"algorithm": "ppo" if translated else usual_algorithm(id)}
    name = str({**usual, **chosen}["algorithm"])
    record = algorithm_record(name) if trains or name in plugins.records(AlgorithmRecord) else None
    tuned = ConfigMapping() if translated else merge(usual, {} if record is None else _tuned(record, id))
    given = merge(tuned, from_file, from_flags, from_settings)
    controller = _environment_kwargs(given).get("controller")
    merged = merge(*_with_section(tuned, controller), *_with_section(from_file, controller), from_flags, from_settings)
    config = check_config(merged)
    kwargs = with_fixed_keywords(config.environment, config.environment_kwargs)
    config = config.model_copy(update={"environment_kwargs": kwargs})
    if check_parts:
        for simulator in config.simulators:  # before the algorithm's library is imported
            check_environment(config.environment, config.keywords(simulator=simulator))
    if record is None:
        return config
    own = _with_threads(merged.get("algorithm_config", {}), config.threads.torch)
    return config.model_copy(update={"algorithm_config": resolve_algorithm_config(record, own)})


def check_config(merged: Mapping[str, Any]) -> RunConfig:
    """Validate merged settings, except the algorithm's settings, and return the configuration."""
    config = validate(RunConfig, merged, OWNER)
    _check_randomize(merged)
    _check_stop(config)
    check_components(config.wrappers, merged.get("wrappers"), "wrapper")
    check_components(config.callbacks, merged.get("callbacks"), "callback")
    if config.log:
        from frobs_train.logs.services import check_services

        check_services(config.log)
    return config


def _check_sections(settings: Mapping[str, Any]) -> None:
    for key in settings:
        if key not in RunConfig.model_fields:
            similar = nearest(key, RunConfig.model_fields)
            meant = f" Did you mean '{similar}'?" if similar else ""
            raise CommandLineError(
                f"--set {key}",
                f"{OWNER} has no setting '{key}'.{meant} Write "
                f"algorithm_config.{key}=VALUE for a setting of the algorithm, and environment_kwargs.{key}=VALUE for "
                "a keyword argument of the environment.",
            )


def _check_stop(config: RunConfig) -> None:
    if config.stop_at_success is not None and config.evaluate_every is None:
        raise MissingSettingError(
            f"{OWNER}: stop_at_success",
            "evaluate_every",
            "stop_at_success uses the success rate of the evaluations during training",
        )


def _with_threads(settings: Mapping[str, Any], torch: int | None) -> Mapping[str, Any]:
    if torch is None:
        return settings
    given = settings.get("torch_threads", torch)
    if given != torch:
        raise ConflictingOptionsError(
            [f"threads.torch = {torch}", f"algorithm_config.torch_threads = {given}"], "set only one of them"
        )
    return merge(settings, {"torch_threads": torch})


def _check_randomize(merged: Mapping[str, Any]) -> None:
    if "randomize" in _environment_kwargs(merged):
        reason = "'randomize' is a top-level setting; move it out of environment_kwargs."
        origin = find_origin(merged, ["environment_kwargs", "randomize"])
        raise ConfigFileError(*origin, reason) if origin else ConfigurationError(f"{OWNER}: {reason}")
    read_settings(merged.get("randomize"))


def _from_flags(environment: str | None, flags: Mapping[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in flags.items() if value is not None}
    if environment is not None:
        given["environment"] = environment
    if isinstance(given.get("num_envs"), str):
        given["num_envs"] = read_num_envs(given["num_envs"])
    given = absolute_files(given)  # the configuration must not depend on the working directory
    if given.get("gripper"):
        given["gripper"] = {"joints": given["gripper"].split(",")}  # so that it can be merged with other settings
    for name in (*ROBOT_FLAGS, "base", "simulator", "controller", "object", "object_mass", "object_scale"):
        if name in given:
            given["environment_kwargs"] = {**given.get("environment_kwargs", {}), name: given.pop(name)}
    return given


def usual_algorithm(id: str) -> str:
    """Return the name of the algorithm that trains on an environment ID unless the user chooses another."""
    found = environments().get(bare_id(id))
    return "ppo" if found is None else found[1].algorithm


def read_num_envs(text: str) -> int | dict[str, int]:
    """Parse a number of environments, or the number on each simulator, such as ``"mujoco=48,pybullet=16"``.

    Raises:
        CommandLineError: The text has another form.
    """
    if re.fullmatch(r"[0-9]+", text):
        return int(text)
    pairs = re.findall(r"([^=,]+)=([0-9]+)(?:,|$)", text)
    if ",".join(f"{name}={count}" for name, count in pairs) != text or len(dict(pairs)) < len(pairs):
        raise CommandLineError(
            "--num-envs",
            f"'{text:.80}' is neither a whole number nor a number for each simulator, such as mujoco=48,pybullet=16.",
        )
    return {name: int(count) for name, count in pairs}


def write_num_envs(num_envs: int | Mapping[str, int]) -> str:
    """Return a number of environments in the form that :func:`read_num_envs` and ``--num-envs`` accept."""
    if isinstance(num_envs, Mapping):
        return ",".join(f"{name}={count}" for name, count in num_envs.items())
    return str(num_envs)


def read_setting(setting: str) -> dict[str, Any]:
    """Parse a ``setting`` such as ``section.key=value``, with a YAML value, into nested mappings.

    Raises:
        CommandLineError: The setting does not have this form.
    """
    path, equals, text = setting.partition("=")
    keys = path.strip().split(".")
    if not equals or not all(keys):
        raise CommandLineError(f"--set {setting}", "a setting must have the form key=value or section.key=value.")
    value = load_yaml_value(text, f"--set {setting:.80}")
    for key in reversed(keys):
        value = {key: value}
    return cast("dict[str, Any]", value)


def write_setting(key: str, value: Any) -> str:
    """Return a setting in the form ``"key=value"``, which :func:`read_setting` and ``--set`` accept."""
    return f"{key}=" + re.sub(_QUOTED_NUMBER, r"\1", to_json(spell_numbers(value)))


def _tuned(record: AlgorithmRecord, environment: str) -> ConfigMapping:
    resource = record.tuned.get(bare_id(environment))
    if resource is None:
        return ConfigMapping()
    package, _, path = resource.partition(":")
    return load_yaml_text(resources.files(package).joinpath(path).read_text("utf-8"), f"{package}/{path}")


def _environment_kwargs(mapping: Mapping[str, Any]) -> Mapping[str, Any]:
    kwargs = mapping.get("environment_kwargs")
    return kwargs if isinstance(kwargs, Mapping) else {}


def _with_section(layer: ConfigMapping, controller: Any) -> tuple[Mapping[str, Any], ...]:
    """Return a layer's general settings, followed by the section of the chosen controller if this section exists."""
    sections = layer.get("controllers")
    if sections is None:
        return (layer,)
    rest = ConfigMapping({key: value for key, value in layer.items() if key != "controllers"}, layer.origins)
    if not isinstance(sections, Mapping) or not all(isinstance(section, Mapping) for section in sections.values()):
        raise ConfigFileError(
            *layer.origins["controllers"], "'controllers' must contain one mapping for each controller."
        )
    section = sections.get(controller)
    return (rest,) if section is None else (rest, section)

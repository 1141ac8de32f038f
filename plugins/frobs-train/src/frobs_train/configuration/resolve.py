"""Resolve the configuration of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, cast

from frobs_core.errors import (
    CommandLineError,
    ConfigFileError,
    ConfigurationError,
    ConflictingOptionsError,
    MissingSettingError,
)
from frobs_core.randomization import read_settings
from frobs_core.specs import AlgorithmRecord
from frobs_core.validation import validate
from frobs_core.yaml import ConfigMapping, find_origin, load_yaml_text, load_yaml_value, merge
from frobs_train.configuration.components import check_components
from frobs_train.configuration.config import OWNER, RunConfig, algorithm_record, resolve_algorithm_config
from frobs_train.configuration.other_layouts import read_config_file


def resolve_config(
    environment: str | None = None,
    *,
    file: Path | str | None = None,
    flags: Mapping[str, Any] | None = None,
    settings: Sequence[str] = (),
) -> RunConfig:
    """Resolve a configuration from its sources; later sources in this list override earlier ones.

    1. the settings that the algorithm's record has tuned for this ID; 2. the file; 3. the flags; 4. the settings.
    If the file has another layout that the algorithm supports, it is translated and the tuned settings are not used.
    The file may have a section ``controllers`` with one mapping per controller. Only the mapping of the chosen
    controller is used.

    Args:
        environment: Gymnasium ID; None: the ID in the file.
        file: YAML file with the keys of :class:`RunConfig`.
        flags: Keys of :class:`RunConfig`, and the keys of ``environment_kwargs`` that have their own flags: ``robot``,
            ``tcp``, ``base``, ``simulator`` and ``controller``. Values that are None are ignored.
        settings: Dotted keys and YAML values, such as ``"algorithm_config.n_steps=16"``.

    Returns:
        The configuration, including all defaults of the algorithm.

    Raises:
        UnknownNameError: No algorithm has this name.
        UnknownParameterError: A key is unknown.
        ConfigurationError: A value cannot be used.
        ConfigFileError: A key in a file is unknown, or a value in it cannot be used.
    """
    from_flags = _from_flags(environment, flags or {})
    from_settings = merge(*(read_setting(setting) for setting in settings))
    from_file, translated = ConfigMapping(), False
    if file is not None:
        from_file, translated = read_config_file(file, merge(from_flags, from_settings).get("algorithm"))
    chosen = merge({"environment": "", "algorithm": "ppo"}, from_file, from_flags, from_settings)
    record = algorithm_record(str(chosen["algorithm"]))
    tuned = ConfigMapping() if translated else _tuned(record, str(chosen["environment"]))
    given = merge(tuned, from_file, from_flags, from_settings)
    controller = _environment_kwargs(given).get("controller")
    merged = merge(*_with_section(tuned, controller), *_with_section(from_file, controller), from_flags, from_settings)
    config = check_config(merged)
    own = _with_threads(merged.get("algorithm_config", {}), config.threads.torch)
    return config.model_copy(update={"algorithm_config": resolve_algorithm_config(record, own)})


def check_config(merged: Mapping[str, Any]) -> RunConfig:
    """Validate merged settings and return their configuration. Settings of the algorithm are not checked.

    Raises:
        ConfigurationError: A key is unknown, or a value cannot be used.
    """
    config = validate(RunConfig, merged, OWNER)
    _check_randomize(merged)
    _check_stop(config)
    check_components(config.wrappers, merged.get("wrappers"), "wrapper")
    check_components(config.callbacks, merged.get("callbacks"), "callback")
    if config.log:
        from frobs_train.logs.services import check_services

        check_services(config.log)
    return config


def _check_stop(config: RunConfig) -> None:
    """Reject a success threshold if there are no evaluations to compare it with."""
    if config.stop_at_success is not None and config.evaluate_every is None:
        raise MissingSettingError(
            f"{OWNER}: stop_at_success",
            "evaluate_every",
            "stop_at_success is compared with the evaluations during the training run",
        )


def _with_threads(settings: Mapping[str, Any], torch: int | None) -> Mapping[str, Any]:
    """Add the number of threads of the algorithm's library to its settings."""
    if torch is None:
        return settings
    given = settings.get("torch_threads", torch)
    if given != torch:
        raise ConflictingOptionsError(
            [f"threads.torch = {torch}", f"algorithm_config.torch_threads = {given}"], "set only one of them"
        )
    return merge(settings, {"torch_threads": torch})


def _check_randomize(merged: Mapping[str, Any]) -> None:
    """Reject invalid randomization settings, and settings in the wrong place."""
    if "randomize" in _environment_kwargs(merged):
        reason = "'randomize' belongs next to environment_kwargs, not in it; move it there."
        origin = find_origin(merged, ["environment_kwargs", "randomize"])
        raise ConfigFileError(*origin, reason) if origin else ConfigurationError(f"{OWNER}: {reason}")
    read_settings(merged.get("randomize"))


def _from_flags(environment: str | None, flags: Mapping[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in flags.items() if value is not None}
    if environment is not None:
        given["environment"] = environment
    if Path(str(given.get("robot", ""))).is_file():  # the configuration must not depend on the working directory
        given["robot"] = str(Path(given["robot"]).resolve())
    for name in ("robot", "tcp", "base", "simulator", "controller"):
        if name in given:
            given["environment_kwargs"] = {**given.get("environment_kwargs", {}), name: given.pop(name)}
    return given


def read_setting(setting: str) -> dict[str, Any]:
    """Parse ``key=value`` or ``section.key=value``, with a YAML value, into nested mappings."""
    path, equals, text = setting.partition("=")
    keys = path.strip().split(".")
    if not equals or not all(keys):
        raise CommandLineError(f"--set {setting}", "write it as key=value or section.key=value.")
    value = load_yaml_value(text, f"--set {setting}")
    for key in reversed(keys):
        value = {key: value}
    return cast("dict[str, Any]", value)


def _tuned(record: AlgorithmRecord, environment: str) -> ConfigMapping:
    resource = record.tuned.get(environment.rpartition(":")[2])
    if resource is None:
        return ConfigMapping()
    package, _, path = resource.partition(":")
    return load_yaml_text(resources.files(package).joinpath(path).read_text("utf-8"), f"{package}/{path}")


def _environment_kwargs(mapping: Mapping[str, Any]) -> Mapping[str, Any]:
    kwargs = mapping.get("environment_kwargs")
    return kwargs if isinstance(kwargs, Mapping) else {}


def _with_section(layer: ConfigMapping, controller: Any) -> tuple[Mapping[str, Any], ...]:
    """Split a layer into the layer without its controller sections, and the section of a controller, if any."""
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

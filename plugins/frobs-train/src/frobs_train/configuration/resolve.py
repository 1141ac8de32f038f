"""Putting the configuration of a run together."""

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
    """Put a configuration together; what comes later in the list wins.

    1. what the algorithm's record has tuned for this ID; 2. the file; 3. the flags; 4. the settings.
    A file in another layout that the algorithm knows is translated, and stands for itself: what was tuned is left out.
    A file may have a section ``controllers`` with one mapping for each controller, which counts when that controller
    is chosen.

    Args:
        environment: Gymnasium ID; None: the file has it.
        file: A YAML file with the keys of :class:`RunConfig`.
        flags: Keys of :class:`RunConfig`, and those of ``environment_kwargs`` that have flags of their own: ``robot``,
            ``tcp``, ``base``, ``simulator`` and ``controller``; those that are None do not count.
        settings: ``"algorithm_config.n_steps=16"``: a dotted key and a YAML value.

    Returns:
        The configuration, with every default of the algorithm filled in.

    Raises:
        UnknownNameError: No algorithm has the name.
        UnknownParameterError: A key is unknown.
        ConfigurationError: A value cannot be used.
        ConfigFileError: Either, in a file.
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
    """Return the configuration that merged settings make; the algorithm's settings are not checked.

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
    """Refuse a threshold that nothing is compared with."""
    if config.stop_at_success is not None and config.evaluate_every is None:
        raise MissingSettingError(
            f"{OWNER}: stop_at_success", "evaluate_every", "it is compared with evaluations during the training run"
        )


def _with_threads(settings: Mapping[str, Any], torch: int | None) -> Mapping[str, Any]:
    """Hand the threads of the algorithm's library over to its own settings."""
    if torch is None:
        return settings
    given = settings.get("torch_threads", torch)
    if given != torch:
        raise ConflictingOptionsError(
            [f"threads.torch = {torch}", f"algorithm_config.torch_threads = {given}"], "set only one of them"
        )
    return merge(settings, {"torch_threads": torch})


def _check_randomize(merged: Mapping[str, Any]) -> None:
    """Refuse what no environment could be randomised with, and a second place to write it."""
    if "randomize" in _environment_kwargs(merged):
        reason = "'randomize' stands beside environment_kwargs, not in it; move it there."
        origin = find_origin(merged, ["environment_kwargs", "randomize"])
        raise ConfigFileError(*origin, reason) if origin else ConfigurationError(f"{OWNER}: {reason}")
    read_settings(merged.get("randomize"))


def _from_flags(environment: str | None, flags: Mapping[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in flags.items() if value is not None}
    if environment is not None:
        given["environment"] = environment
    if Path(str(given.get("robot", ""))).is_file():  # so that the run is found to be the same from any other folder
        given["robot"] = str(Path(given["robot"]).resolve())
    for name in ("robot", "tcp", "base", "simulator", "controller"):
        if name in given:
            given["environment_kwargs"] = {**given.get("environment_kwargs", {}), name: given.pop(name)}
    return given


def read_setting(setting: str) -> dict[str, Any]:
    """Return ``key=value`` or ``section.key=value``, with a YAML value, as nested mappings."""
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
    """Take the section of a controller out of a layer, to be laid over it."""
    sections = layer.get("controllers")
    if sections is None:
        return (layer,)
    rest = ConfigMapping({key: value for key, value in layer.items() if key != "controllers"}, layer.origins)
    if not isinstance(sections, Mapping) or not all(isinstance(section, Mapping) for section in sections.values()):
        raise ConfigFileError(*layer.origins["controllers"], "'controllers' must hold one mapping for each controller.")
    section = sections.get(controller)
    return (rest,) if section is None else (rest, section)

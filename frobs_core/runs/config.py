"""The configuration of a run, and how it is put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from frobs_core.errors import ConfigFileError, ConfigurationError, UnknownParameterError
from frobs_core.plugins import get_record
from frobs_core.randomization import read_settings
from frobs_core.runs.parts import check_parts
from frobs_core.specs import AlgorithmRecord
from frobs_core.validation import validate
from frobs_core.yaml import ConfigMapping, find_origin, load_yaml, load_yaml_text, load_yaml_value, merge

_OWNER = "the run configuration"


def _or_nothing(value: Any) -> Any:
    return {} if value is None else value


class ThreadsConfig(BaseModel):
    """Threads, where another number than the usual is wanted.

    Attributes:
        simulator: Threads, or worker processes, of the simulator; None: one for each processor.
        torch: Threads of the algorithm's library; None: what ``algorithm_config.torch_threads`` says.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    simulator: Annotated[int, Field(ge=1)] | None = None
    torch: Annotated[int, Field(ge=1)] | None = None


class PartConfig(BaseModel):
    """Something by name, with the keywords that it is built with standing beside the name.

    Attributes:
        name: ``"package.module:Name"``.
    """

    model_config = ConfigDict(frozen=True, extra="allow")

    name: Annotated[str, Field(min_length=3)]

    @property
    def kwargs(self) -> dict[str, Any]:
        """The keywords."""
        return dict(self.model_extra or {})


class RunConfig(BaseModel):
    """Everything that a training is made from.

    Attributes:
        environment: Gymnasium ID; ``"module:ID"`` imports the module first.
        environment_kwargs: Keywords of the environment: simulator, controller, task parameters, …
        randomize: What differs between environments and episodes of the training; an evaluation leaves it out unless it
            is asked for. See :mod:`frobs_core.randomization`.
        algorithm: Name of the algorithm.
        algorithm_config: The algorithm's own settings.
        num_envs: Environments that are stepped together.
        steps: Environment steps, over all environments.
        seed: Everything random comes from it; None: another one each time.
        log_every: [environment steps] between rows of the log, at least; None: a five-hundredth of ``steps``.
        checkpoint_every: [environment steps] between checkpoints; None: a tenth of ``steps``.
        keep_checkpoints: How many of the newest checkpoints stay.
        evaluate_every: [environment steps] between evaluations during the training, of the policy's mode on episodes
            of their own; the best policy is kept. None: never.
        evaluation_episodes: Of each of those evaluations.
        stop_at_success: The training ends when an evaluation finds this share of successes, in (0, 1]; None: never.
        threads: Who gets how many; see :func:`frobs_core.runs.threads.decide_threads`.
        wrappers: Gymnasium's wrappers around the environment, the innermost first: each with ``name`` and its keywords.
        callbacks: Subclasses of :class:`frobs_core.runs.TrainingCallback`: each with ``name`` and its keywords.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    environment: Annotated[str, Field(min_length=1)]
    environment_kwargs: dict[str, Any] = Field(default_factory=dict)
    randomize: dict[str, Any] = Field(default_factory=dict)
    algorithm: str = "ppo"
    algorithm_config: dict[str, Any] = Field(default_factory=dict)
    num_envs: Annotated[int, Field(ge=1)] = 8
    steps: Annotated[int, Field(ge=1)] = 100_000
    seed: Annotated[int, Field(ge=0)] | None = None
    log_every: Annotated[int, Field(ge=1)] | None = None
    checkpoint_every: Annotated[int, Field(ge=1)] | None = None
    keep_checkpoints: Annotated[int, Field(ge=1)] = 3
    evaluate_every: Annotated[int, Field(ge=1)] | None = None
    evaluation_episodes: Annotated[int, Field(ge=1)] = 100
    stop_at_success: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    threads: Annotated[ThreadsConfig, BeforeValidator(_or_nothing)] = ThreadsConfig()
    wrappers: list[PartConfig] = []
    callbacks: list[PartConfig] = []

    def keywords(
        self, *, simulator: str | None = None, randomize: bool | Mapping[str, Any] | None = None
    ) -> dict[str, Any]:
        """Return the keywords that the environment is made with.

        Args:
            simulator: Another one than the training's.
            randomize: None: as in the training, if it is; True: as in the training; False: the nominal models; or what
                to randomise instead.

        Raises:
            ConfigurationError: As in the training, which randomises nothing.
        """
        if randomize is True and not self.randomize:
            raise ConfigurationError(f"{_OWNER} randomises nothing; leave out --randomized, or give what to randomise.")
        chosen = self.randomize if randomize is None or randomize is True else randomize
        return {
            **self.environment_kwargs,
            **({"simulator": simulator} if simulator else {}),
            **({"randomize": dict(chosen)} if chosen else {}),
        }


def resolve_config(
    environment: str | None = None,
    *,
    file: Path | str | None = None,
    flags: Mapping[str, Any] | None = None,
    settings: Sequence[str] = (),
) -> RunConfig:
    """Put a configuration together; what comes later in the list wins.

    1. what the algorithm's record has tuned for this ID; 2. the file; 3. the flags; 4. the settings.
    A file may have a section ``controllers`` with one mapping for each controller, which counts when that controller
    is chosen.

    Args:
        environment: Gymnasium ID; None: the file has it.
        file: A YAML file with the keys of :class:`RunConfig`.
        flags: Keys of :class:`RunConfig`, and those of ``environment_kwargs`` that have flags of their own: ``robot``,
            ``tcp``, ``simulator`` and ``controller``; those that are None do not count.
        settings: ``"algorithm_config.n_steps=16"``: a dotted key and a YAML value.

    Returns:
        The configuration, with every default of the algorithm filled in.

    Raises:
        UnknownNameError: No algorithm has the name.
        UnknownParameterError: A key is unknown.
        ConfigurationError: A value cannot be used.
        ConfigFileError: Either, in a file.
    """
    from_file = load_yaml(file) if file is not None else ConfigMapping()
    from_flags = _from_flags(environment, flags or {})
    from_settings = merge(*(_from_setting(setting) for setting in settings))
    chosen = merge({"environment": "", "algorithm": "ppo"}, from_file, from_flags, from_settings)
    record = algorithm_record(str(chosen["algorithm"]))
    tuned = _tuned(record, str(chosen["environment"]))
    given = merge(tuned, from_file, from_flags, from_settings)
    controller = _environment_kwargs(given).get("controller")
    merged = merge(*_with_section(tuned, controller), *_with_section(from_file, controller), from_flags, from_settings)
    config = validate(RunConfig, merged, _OWNER)
    _check_randomize(merged)
    _check_stop(config)
    check_parts(config.wrappers, merged.get("wrappers"), "wrapper")
    check_parts(config.callbacks, merged.get("callbacks"), "callback")
    own = _with_threads(merged.get("algorithm_config", {}), config.threads.torch)
    return config.model_copy(update={"algorithm_config": resolve_algorithm_config(record, own)})


def _check_stop(config: RunConfig) -> None:
    """Refuse a threshold that nothing is compared with."""
    if config.stop_at_success is not None and config.evaluate_every is None:
        raise ConfigurationError(
            f"{_OWNER}: stop_at_success = {config.stop_at_success} is compared with evaluations during the training, "
            "of which there are none; set evaluate_every, too."
        )


def _with_threads(settings: Mapping[str, Any], torch: int | None) -> Mapping[str, Any]:
    """Hand the threads of the algorithm's library over to its own settings."""
    if torch is None:
        return settings
    given = settings.get("torch_threads", torch)
    if given != torch:
        raise ConfigurationError(
            f"{_OWNER}: threads.torch = {torch} and algorithm_config.torch_threads = {given} contradict each other; "
            "leave one of them out."
        )
    return merge(settings, {"torch_threads": torch})


def _check_randomize(merged: Mapping[str, Any]) -> None:
    """Refuse what no environment could be randomised with, and a second place to write it."""
    if "randomize" in _environment_kwargs(merged):
        reason = "'randomize' stands beside environment_kwargs, not in it; move it there."
        origin = find_origin(merged, ["environment_kwargs", "randomize"])
        raise ConfigFileError(*origin, reason) if origin else ConfigurationError(f"{_OWNER}: {reason}")
    read_settings(merged.get("randomize"))


def algorithm_record(name: str) -> AlgorithmRecord:
    """Return an algorithm's record.

    Raises:
        UnknownNameError: No algorithm has the name.
    """
    return cast(AlgorithmRecord, get_record("algorithm", name))


def resolve_algorithm_config(record: AlgorithmRecord, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Check an algorithm's settings and fill in its defaults; what is filled in already stays as it is.

    Raises:
        ConfigurationError: A key is unknown or a value cannot be used.
    """
    try:
        return dict(record.load().resolve_config(settings))
    except UnknownParameterError as error:  # of an algorithm that does not look at where a key was written
        origin = find_origin(settings, [error.name])
        if origin is None:
            raise
        raise ConfigFileError(*origin, str(error)) from None


def _from_flags(environment: str | None, flags: Mapping[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in flags.items() if value is not None}
    if environment is not None:
        given["environment"] = environment
    if Path(str(given.get("robot", ""))).is_file():  # so that the run is found to be the same from any other folder
        given["robot"] = str(Path(given["robot"]).resolve())
    for name in ("robot", "tcp", "simulator", "controller"):
        if name in given:
            given["environment_kwargs"] = {**given.get("environment_kwargs", {}), name: given.pop(name)}
    return given


def _from_setting(setting: str) -> dict[str, Any]:
    path, equals, text = setting.partition("=")
    keys = path.strip().split(".")
    if not equals or not all(keys):
        raise ConfigurationError(f"--set {setting}: write it as key=value or section.key=value.")
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

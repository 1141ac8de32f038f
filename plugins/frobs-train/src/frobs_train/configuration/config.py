"""Configuration of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, cast

from pydantic import BaseModel, ConfigDict, Field, field_validator

from frobs_core.errors import ConfigFileError, ConfigurationError, UnknownParameterError
from frobs_core.plugins import get_record
from frobs_core.specs import AlgorithmRecord
from frobs_core.yaml import find_origin

OWNER = "the run configuration"
"""Name of the configuration in errors."""


class ThreadsConfig(BaseModel):
    """Numbers of threads that override the defaults.

    Attributes:
        simulator: Threads or worker processes of the simulator; None: one per processor.
        torch: Threads of the algorithm's library; None: ``algorithm_config.torch_threads``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    simulator: Annotated[int, Field(ge=1)] | None = None
    torch: Annotated[int, Field(ge=1)] | None = None


class ComponentConfig(BaseModel):
    """A wrapper or callback, given by name. All other keys are keywords of its constructor.

    Attributes:
        name: ``"package.module:Name"``.
    """

    model_config = ConfigDict(frozen=True, extra="allow")

    name: Annotated[str, Field(min_length=3)]

    @property
    def kwargs(self) -> dict[str, Any]:
        """The keywords."""
        return dict(self.model_extra or {})


class ResetFromConfig(BaseModel):
    """Reverse curriculum: some training episodes begin in states on the path of the task's expert.

    Attributes:
        share: Share of the episodes that begin on the path, in (0, 1].
        success: Success rate, in (0, 1), at which the start moves back by one state.
        states: Number of states on the path of each episode.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    success: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.6
    states: Annotated[int, Field(ge=2, le=1000)] = 25


class RunConfig(BaseModel):
    """Complete configuration of a training run.

    Attributes:
        environment: Gymnasium ID; ``"module:ID"`` imports the module first.
        environment_kwargs: Keywords of the environment: simulator, controller, task parameters, …
        randomize: Randomization of environments and episodes during training. Evaluations use it only on request. See
            :mod:`frobs_core.randomization`.
        reset_from: Reverse curriculum of the training run, see :class:`frobs_train.ResetFromConfig`; None: all episodes
            begin as usual. Episodes of evaluations always begin as usual.
        stagger: Whether the first episodes end at random times, so that not all episodes reach the time limit at once.
        algorithm: Name of the algorithm.
        algorithm_config: Settings of the algorithm.
        num_envs: Number of environments that are stepped together.
        steps: Environment steps, summed over all environments.
        seed: Seed of all random numbers; None: a new seed for each run.
        log_every: Minimum number of environment steps between rows of the log; None: a five-hundredth of ``steps``.
        checkpoint_every: Environment steps between checkpoints; None: a tenth of ``steps``.
        keep_checkpoints: Number of newest checkpoints to keep.
        evaluate_every: Environment steps between evaluations during training. They play the deterministic policy on
            separate episodes, and the best policy is kept. None: never.
        evaluation_episodes: Number of episodes of each of these evaluations.
        stop_at_success: Success rate of an evaluation, in (0, 1], at which training ends; None: never.
        threads: Numbers of threads; see :func:`frobs_train.decide_threads`.
        wrappers: Gymnasium wrappers around the environment, innermost first, each with ``name`` and its keywords.
        callbacks: Subclasses of :class:`frobs_train.TrainingCallback`, each with ``name`` and its keywords.
        log: Services that receive the log and evaluations in addition to ``progress.csv``: ``"wandb"``, ``"mlflow"``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    environment: Annotated[str, Field(min_length=1)]
    environment_kwargs: dict[str, Any] = Field(default_factory=dict)
    randomize: dict[str, Any] = Field(default_factory=dict)
    reset_from: ResetFromConfig | None = None
    stagger: bool = False
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
    threads: ThreadsConfig = ThreadsConfig()
    wrappers: list[ComponentConfig] = []
    callbacks: list[ComponentConfig] = []
    log: list[Literal["wandb", "mlflow"]] = []

    @field_validator("threads", mode="before")
    @classmethod
    def _accept_an_empty_section(cls, value: Any) -> Any:
        return {} if value is None else value

    def keywords(
        self, *, simulator: str | None = None, randomize: bool | Mapping[str, Any] | None = None
    ) -> dict[str, Any]:
        """Return the keywords of the environment.

        Args:
            simulator: Name of the simulator; None: the simulator of the training run.
            randomize: None: the randomization of the training run, if any; True: the same, but required; False: the
                nominal models; a mapping: other randomization settings.

        Raises:
            ConfigurationError: ``randomize`` is True, but the training run does not randomize anything.
        """
        if randomize is True and not self.randomize:
            raise ConfigurationError(
                f"{OWNER} does not randomize anything; leave out --randomized, or specify what to randomize."
            )
        chosen = self.randomize if randomize is None or randomize is True else randomize
        return {
            **self.environment_kwargs,
            **({"simulator": simulator} if simulator else {}),
            **({"randomize": dict(chosen)} if chosen else {}),
        }


def differences(
    before: Mapping[str, Any], after: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, Any, Any]]:
    """Yield dotted key, old value and new value of each setting that differs; a missing value is None."""
    for key in {**after, **before}:
        old, new = before.get(key), after.get(key)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from differences(old, new, f"{prefix}{key}.")
        elif old != new or (key in before) != (key in after):
            yield f"{prefix}{key}", old, new


def algorithm_record(name: str) -> AlgorithmRecord:
    """Return the record of an algorithm."""
    return cast(AlgorithmRecord, get_record("algorithm", name))


def resolve_algorithm_config(record: AlgorithmRecord, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Check the settings of an algorithm and add its defaults. Complete settings are returned unchanged."""
    try:
        return dict(record.load().resolve_config(settings))
    except UnknownParameterError as error:  # the algorithm does not report the file and line
        origin = find_origin(settings, [error.name])
        if origin is None:
            raise
        raise ConfigFileError(*origin, str(error)) from None

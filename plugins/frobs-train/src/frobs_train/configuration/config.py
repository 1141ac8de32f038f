"""The configuration of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, cast

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from frobs_core.errors import ConfigFileError, ConfigurationError, UnknownParameterError
from frobs_core.plugins import get_record
from frobs_core.specs import AlgorithmRecord
from frobs_core.yaml import find_origin

OWNER = "the run configuration"
"""What errors call it."""


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


class ComponentConfig(BaseModel):
    """A wrapper or callback by name; further keys are the keywords of its constructor.

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
    """The reverse curriculum: some training episodes begin in states on the path of the task's expert.

    Attributes:
        share: Share of the episodes that begin on the path, in (0, 1].
        success: Share of successes, in (0, 1), at which the start moves back by one state.
        states: Number of states on the path of an episode.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    success: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.6
    states: Annotated[int, Field(ge=2, le=1000)] = 25


class RunConfig(BaseModel):
    """Everything that a training is made from.

    Attributes:
        environment: Gymnasium ID; ``"module:ID"`` imports the module first.
        environment_kwargs: Keywords of the environment: simulator, controller, task parameters, …
        randomize: What differs between environments and episodes of the training; an evaluation leaves it out unless it
            is asked for. See :mod:`frobs_core.randomization`.
        reset_from: The reverse curriculum of the training, as in :class:`frobs_train.ResetFromConfig`; None: all episodes
            begin as usual. Evaluations always begin as usual.
        stagger: Whether the first episodes end at random times, so that those that last until the time limit do not all end at
            once.
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
        threads: Who gets how many; see :func:`frobs_train.decide_threads`.
        wrappers: Gymnasium's wrappers around the environment, the innermost first: each with ``name`` and its keywords.
        callbacks: Subclasses of :class:`frobs_train.TrainingCallback`: each with ``name`` and its keywords.
        log: Services that receive the log and evaluations besides ``progress.csv``: ``"wandb"``, ``"mlflow"``.
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
    threads: Annotated[ThreadsConfig, BeforeValidator(_or_nothing)] = ThreadsConfig()
    wrappers: list[ComponentConfig] = []
    callbacks: list[ComponentConfig] = []
    log: list[Literal["wandb", "mlflow"]] = []

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
            raise ConfigurationError(f"{OWNER} randomises nothing; leave out --randomized, or give what to randomise.")
        chosen = self.randomize if randomize is None or randomize is True else randomize
        return {
            **self.environment_kwargs,
            **({"simulator": simulator} if simulator else {}),
            **({"randomize": dict(chosen)} if chosen else {}),
        }


def differences(
    before: Mapping[str, Any], after: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, Any, Any]]:
    """Yield dotted key, old and new value of each setting that differs; None if a key is missing."""
    for key in {**after, **before}:
        old, new = before.get(key), after.get(key)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from differences(old, new, f"{prefix}{key}.")
        elif old != new or (key in before) != (key in after):
            yield f"{prefix}{key}", old, new


def algorithm_record(name: str) -> AlgorithmRecord:
    """Return an algorithm's record."""
    return cast(AlgorithmRecord, get_record("algorithm", name))


def resolve_algorithm_config(record: AlgorithmRecord, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Check an algorithm's settings and fill in its defaults; complete settings are returned unchanged."""
    try:
        return dict(record.load().resolve_config(settings))
    except UnknownParameterError as error:  # of an algorithm that does not look at where a key was written
        origin = find_origin(settings, [error.name])
        if origin is None:
            raise
        raise ConfigFileError(*origin, str(error)) from None

"""Configuration of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias, cast

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, field_validator, model_validator

from frobs_core.plugins import get_record
from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigurationError, UnknownParameterError
from frobs_core.util.validation import located, plain_settings

OWNER = "the run configuration"
"""Name of the configuration in error messages."""


class ThreadsConfig(BaseModel):
    """Thread counts that override the defaults.

    Attributes:
        simulator: Number of simulator threads or worker processes. Defaults to one per processor.
        torch: Number of threads of the algorithm's library. Defaults to ``algorithm_config.torch_threads``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    simulator: Annotated[int, Field(ge=1)] | None = None
    torch: Annotated[int, Field(ge=1)] | None = None


class ComponentConfig(BaseModel):
    """Configuration of a wrapper or callback. All keys except ``name`` are passed to the constructor.

    Attributes:
        name: ``"package.module:Name"``.
    """

    model_config = ConfigDict(frozen=True, extra="allow")

    name: Annotated[str, Field(min_length=3)]

    @property
    def kwargs(self) -> dict[str, Any]:
        """Keyword arguments of the constructor."""
        return dict(self.model_extra or {})

    @property
    def adapts(self) -> bool:
        """Whether this is a wrapper whose statistics differ between the training environments and others."""
        return self.name.rpartition(":")[2] in ("NormalizeObservation", "NormalizeReward")


class ResetFromConfig(BaseModel):
    """Reverse curriculum, in which some training episodes begin on the path of the task's expert.

    Attributes:
        share: Fraction of the training steps in episodes that begin on the expert's path, in (0, 1].
        success: Success rate, in (0, 1), at which the earliest start state moves back along the path by one state.
        states: Number of start states on the path of each expert episode.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    success: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.6
    states: Annotated[int, Field(ge=2, le=1000)] = 25


NumEnvs: TypeAlias = Annotated[
    Annotated[Annotated[int, Field(ge=1)], Tag("number")]
    | Annotated[dict[str, Annotated[int, Field(ge=1)]], Tag("simulators")],
    Discriminator(lambda value: "simulators" if isinstance(value, Mapping) else "number"),
]
"""Number of environments, or the number for each simulator."""


class RunConfig(BaseModel):
    """Complete configuration of a training run.

    Attributes:
        environment: Gymnasium ID. If the ID has the form ``"module:ID"``, the module is imported first.
        environment_kwargs: Keyword arguments of the environment, such as simulator, controller and task parameters.
        randomize: Randomization of environments and episodes during training, see
            :mod:`frobs_core.sensing.randomization`. Evaluations are randomized only on request.
        reset_from: Settings of the reverse curriculum, or None for no curriculum. Evaluations never use the curriculum.
        stagger: Whether to end the first episodes at random times, so that the environments do not stay in step.
        algorithm: Name of the algorithm.
        algorithm_config: Settings of the algorithm.
        num_envs: Number of environments in the vector environment, or a mapping from simulators to numbers, such as
            ``{"mujoco": 48, "pybullet": 16}``, to train on several simulators. Evaluations, and everything else that
            needs a single simulator, then use ``environment_kwargs.simulator``, which defaults to the first of them.
        steps: Total number of environment steps, summed over all environments.
        seed: Seed of all random numbers, or None to draw a new seed for each run.
        log_every: Minimum number of environment steps between rows of the log. Defaults to ``steps // 500``.
        checkpoint_every: Number of environment steps between checkpoints. Defaults to ``steps // 10``.
        keep_checkpoints: Number of most recent checkpoints to keep.
        evaluate_every: Number of environment steps between evaluations during training, or None for no evaluations.
            Each evaluation runs the deterministic policy on separate episodes. The best policy is kept.
        evaluation_episodes: Number of episodes of each evaluation during training.
        longest_episode: Number of steps after which an episode that has not ended raises an error in evaluations and
            videos, and causes a warning in training. Environments with a time limit are not affected.
        stop_at_success: Success rate, in (0, 1], at which an evaluation ends training, or None to train for all steps.
        threads: Thread counts, see :func:`frobs_train.decide_threads`.
        wrappers: Gymnasium wrappers of the environment, innermost first, each with a ``name`` and keyword arguments.
        callbacks: Subclasses of :class:`frobs_train.TrainingCallback`, each with a ``name`` and keyword arguments.
        log: Services to which the log and the evaluations are sent, ``"wandb"`` or ``"mlflow"``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    environment: Annotated[str, Field(min_length=1)]
    environment_kwargs: dict[str, Any] = Field(default_factory=dict)
    randomize: dict[str, Any] = Field(default_factory=dict)
    reset_from: ResetFromConfig | None = None
    stagger: bool = False
    algorithm: str = "ppo"
    algorithm_config: dict[str, Any] = Field(default_factory=dict)
    num_envs: NumEnvs = 8
    steps: Annotated[int, Field(ge=1)] = 100_000
    seed: Annotated[int, Field(ge=0)] | None = None
    log_every: Annotated[int, Field(ge=1)] | None = None
    checkpoint_every: Annotated[int, Field(ge=1)] | None = None
    keep_checkpoints: Annotated[int, Field(ge=1)] = 3
    evaluate_every: Annotated[int, Field(ge=1)] | None = None
    evaluation_episodes: Annotated[int, Field(ge=1)] = 100
    longest_episode: Annotated[int, Field(ge=1)] = 20_000
    stop_at_success: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    threads: ThreadsConfig = ThreadsConfig()
    wrappers: list[ComponentConfig] = []
    callbacks: list[ComponentConfig] = []
    log: list[Literal["wandb", "mlflow"]] = []

    @field_validator("threads", mode="before")
    @classmethod
    def _accept_an_empty_section(cls, value: Any) -> Any:
        return {} if value is None else value

    @model_validator(mode="after")
    def _choose_the_simulator(self) -> Self:
        if isinstance(self.num_envs, dict):
            if not self.num_envs:
                raise ValueError("num_envs is {}; it must be a number, or name at least one simulator")
            chosen = self.environment_kwargs.setdefault("simulator", next(iter(self.num_envs)))
            if chosen not in self.num_envs:
                raise ValueError(f"environment_kwargs.simulator is '{chosen}', which is not a simulator of num_envs")
        return self

    @property
    def total_envs(self) -> int:
        """Number of environments, summed over all simulators."""
        return sum(self.num_envs.values()) if isinstance(self.num_envs, dict) else self.num_envs

    @property
    def simulators(self) -> tuple[str | None, ...]:
        """Simulators of the training environments, or None for the simulator of ``environment_kwargs`` or of the ID."""
        return tuple(self.num_envs) if isinstance(self.num_envs, dict) else (None,)

    def keywords(
        self, *, simulator: str | None = None, randomize: bool | Mapping[str, Any] | None = None
    ) -> dict[str, Any]:
        """Return the keyword arguments of the environment.

        Args:
            simulator: Name of the simulator. Defaults to the training run's simulator.
            randomize: True for the training run's randomization, False for the nominal models, or a mapping with other
                randomization settings. Defaults to the training run's randomization, if any.

        Raises:
            ConfigurationError: ``randomize`` is True, but the training run has no randomization.
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
    """Yield the dotted key, old value and new value of each differing setting. Missing values are None."""
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
    """Check the settings of an algorithm and add default values. Complete settings are returned unchanged."""
    try:
        return plain_settings(record.load().resolve_config(settings))
    except UnknownParameterError as error:  # add the file and line, which the algorithm does not report
        raise located(error, settings, [error.name]) from None

"""Search spaces, which define the settings that a search varies and the possible values of each setting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from frobs_core.plugins.records import AlgorithmRecord
from frobs_core.util.errors import ConfigFileError, ConfigurationError, MissingSettingError
from frobs_core.util.plain import spell_numbers, to_json
from frobs_core.util.validation import located, validate
from frobs_core.util.yaml import ConfigMapping, load_yaml, load_yaml_text
from frobs_train.errors import SearchSpaceError

if TYPE_CHECKING:
    import optuna


class Dimension(BaseModel):
    """A setting that a search varies.

    Attributes:
        type: ``float``, ``int`` or ``choice``.
        low: Lower bound of a number.
        high: Upper bound of a number, inclusive.
        log: Whether numbers are drawn uniformly on a logarithmic scale.
        step: Distance between allowed numbers, or None to allow all numbers.
        choices: Possible values of a choice, which can be any YAML values.
        prefix: Text that precedes a number, such as ``lin_`` for a learning rate that decreases linearly to 0.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["float", "int", "choice"]
    low: float | None = None
    high: float | None = None
    log: bool = False
    step: float | None = Field(default=None, gt=0)
    choices: list[Any] | None = Field(default=None, min_length=1)
    prefix: str = ""

    @model_validator(mode="after")
    def _check(self) -> Dimension:
        if self.type == "choice":
            if self.choices is None or self.low is not None or self.high is not None:
                raise ValueError("a dimension of type choice requires 'choices' and does not accept 'low' or 'high'")
            return self
        if self.low is None or self.high is None or self.choices is not None:
            raise ValueError(f"a dimension of type {self.type} requires 'low' and 'high' and does not accept 'choices'")
        if not self.low <= self.high:
            raise ValueError(f"low = {self.low:g} is greater than high = {self.high:g}")
        if self.log and (self.low <= 0 or self.step is not None):
            raise ValueError("if 'log' is true, 'low' must be positive and 'step' must be omitted")
        if self.type == "int" and any(value is not None and value % 1 for value in (self.low, self.high, self.step)):
            raise ValueError("the 'low', 'high' and 'step' of a dimension of type int must be whole numbers")
        return self

    def draw(self, trial: optuna.Trial, key: str) -> Any:
        """Draw a value for an Optuna trial."""
        if self.choices is not None:
            texts = {_text(value): value for value in self.choices}  # Optuna can store only scalar choices
            return texts[trial.suggest_categorical(key, list(texts))]
        low, high = self._bounds
        if self.type == "int":
            step = 1 if self.step is None else int(self.step)
            return self._prefixed(trial.suggest_int(key, int(low), int(high), step=step, log=self.log))
        return self._prefixed(trial.suggest_float(key, low, high, step=self.step, log=self.log))

    def sample(self, rng: np.random.Generator) -> Any:
        """Return a random value."""
        if self.choices is not None:
            return self.choices[int(rng.integers(len(self.choices)))]
        low, high = self._bounds
        if self.log:
            return self._bounded(float(np.exp(rng.uniform(np.log(low), np.log(high)))))
        return self._bounded(float(rng.uniform(low, high)))

    def vary(self, value: Any, rng: np.random.Generator) -> Any:
        """Return a value near ``value``: a neighboring choice, or a number that is about 20 % smaller or larger."""
        if self.choices is not None:
            at = self.choices.index(value) + int(rng.choice([-1, 1]))
            return self.choices[min(max(at, 0), len(self.choices) - 1)]
        old = float(str(value).removeprefix(self.prefix))
        new = old * float(rng.choice([0.8, 1.2]))
        if self.type == "int":
            new = old + max(1.0, abs(new - old)) * (1 if new > old else -1)
        return self._bounded(new)

    def _bounded(self, value: float) -> Any:
        low, high = self._bounds
        if self.step is not None:
            value = low + round((value - low) / self.step) * self.step
        value = min(max(value, low), high)
        return self._prefixed(round(value) if self.type == "int" else value)

    @property
    def example(self) -> Any:
        """An example value."""
        if self.choices is not None:
            return self.choices[0]
        low, _ = self._bounds
        return self._prefixed(int(low) if self.type == "int" else low)

    @property
    def _bounds(self) -> tuple[float, float]:
        assert self.low is not None
        assert self.high is not None
        return self.low, self.high

    def _prefixed(self, value: float) -> Any:
        return f"{self.prefix}{value!r}" if self.prefix else value


SearchSpace = Mapping[str, Dimension]
"""Dimensions of a search. The keys are dotted keys of the run configuration, as accepted by ``--set``."""


def load_space(record: AlgorithmRecord, file: Path | str | None = None) -> SearchSpace:
    """Read the search space from a YAML file, or use the algorithm's default search space."""
    if file is not None:
        return read_space(load_yaml(file))
    if not record.search_space:
        raise MissingSettingError(
            f"algorithm '{record.name}'",
            "a search space",
            "pass a file with --space FILE that contains, for each setting, a line such as "
            "'algorithm_config.learning_rate: {type: float, low: 1e-5, high: 1e-2, log: true}'",
        )
    package, _, path = record.search_space.partition(":")
    return read_space(load_yaml_text(resources.files(package).joinpath(path).read_text("utf-8"), f"{package}/{path}"))


def read_space(mapping: ConfigMapping) -> SearchSpace:
    """Validate a search space. A list is converted to a choice among its items."""
    return {key: _dimension(mapping, key) for key in mapping}


def _dimension(mapping: ConfigMapping, key: str) -> Dimension:
    value = mapping[key]
    if isinstance(value, Sequence) and not isinstance(value, str) and value:
        return Dimension(type="choice", choices=list(value))
    reason = f"'{key}' = {value!r} is not a search range; write a list of values, or {{type: float, low: …, high: …}}."
    if isinstance(value, Mapping):
        try:
            return validate(Dimension, value, f"'{key}' of the search space")
        except ConfigFileError:
            raise
        except ConfigurationError as error:
            reason = str(error)
    raise located(SearchSpaceError(reason, key), mapping, [key])


def _text(value: Any) -> bool | int | float | str | None:
    return value if value is None or isinstance(value, bool | int | float | str) else to_json(spell_numbers(value))

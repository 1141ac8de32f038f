"""The observation of an environment, assembled from named terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError, ObservationTermError

Observation: TypeAlias = np.ndarray[Any, Any] | dict[str, np.ndarray[Any, Any]]
"""(num_envs, …), or a dictionary of such arrays."""

VECTORS = "observation"
"""Key of the vectors in a dictionary observation; also names the only array of an observation that is no dictionary."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservationTerm:
    """One named part of an observation.

    Attributes:
        read: Returns the current value, (num_envs, …). The environment copies it.
        low: Smallest values, of the shape of one environment's value.
        high: Largest values, of the same shape.
        unit: Unit of the values: ``"m"``.
        scale: Suggested factor for a learner, which makes the differences that matter about 1.
        key: Key of a dictionary observation. The vectors of one key are joined in the order of the terms.
        dtype: ``"float32"`` for a vector; an image may have another, and needs a key of its own.
        imperfect: Whether it reads a sensor with noise, delay or another imperfection of its own. ``randomize`` then rejects
            noise and delays of this term.
        view: The camera of an image, for the records of policies that use it: name of the ``camera``, its place and field of
            view as in :class:`~frobs_core.interfaces.Camera`, the ``modality``, and whether ``markers`` are drawn.
    """

    read: Callable[[], np.ndarray[Any, Any]]
    low: np.ndarray[Any, Any]
    high: np.ndarray[Any, Any]
    unit: str
    scale: float = 1.0
    key: str = VECTORS
    dtype: str = "float32"
    imperfect: bool = False
    view: Mapping[str, Any] | None = None

    @property
    def is_vector(self) -> bool:
        """Whether it can be joined with others."""
        return self.low.ndim == 1 and self.dtype == "float32"


class Observations:
    """Assembles the observations of all environments.

    Args:
        num_envs: ≥ 1.
        terms: By name, in the order of the observation.

    Attributes:
        terms: As given.
        columns: Key and columns of each term; all columns for an image.
        space: Of one environment: a float32 Box if all terms are vectors under ``"observation"``, else a Dict.
        vector_reads: Functions that read the terms, where the observation is one vector; else None.
        scale: (k,) the suggested scale of each column under ``"observation"``.

    Raises:
        ConfigurationError: There are no terms, the bounds of a term have different shapes, or an image shares its key.
    """

    def __init__(self, num_envs: int, terms: Mapping[str, ObservationTerm]) -> None:
        self._num_envs = num_envs
        self.terms = dict(terms)
        self.columns: dict[str, tuple[str, slice]] = {}
        parts: dict[str, dict[str, ObservationTerm]] = {}
        for name, term in self.terms.items():
            if term.low.shape != term.high.shape:
                raise ObservationTermError(name, f"has bounds of shapes {term.low.shape} and {term.high.shape}.")
            part = parts.setdefault(term.key, {})
            part[name] = term
            if not term.is_vector:
                self.columns[name] = term.key, slice(None)
                continue
            start = sum(len(other.low) for other in part.values()) - len(term.low)
            self.columns[name] = term.key, slice(start, start + len(term.low))
        if not parts:
            raise ConfigurationError("the task returns no observation terms; it must return at least one.")
        for key, part in parts.items():
            images = [name for name, term in part.items() if not term.is_vector]
            if images and (len(part) > 1 or key == VECTORS):
                raise ObservationTermError(
                    images[0], f"is no float32 vector, so it needs a key of its own, not '{key}'."
                )
        spaces: dict[str, gym.Space[Any]] = {key: _space(list(part.values())) for key, part in parts.items()}
        self.space: gym.Space[Any] = spaces[VECTORS] if spaces.keys() == {VECTORS} else gym.spaces.Dict(spaces)
        vectors = parts.get(VECTORS, {}).values()
        self.scale: Floats = np.concatenate([np.zeros(0), *(np.full(len(term.low), term.scale) for term in vectors)])
        self._reads = {key: [term.read for term in part.values()] for key, part in parts.items()}
        self._images = {term.key: term.dtype for term in self.terms.values() if not term.is_vector}
        self.vector_reads = self._reads[VECTORS] if spaces.keys() == {VECTORS} else None

    def observe(self) -> Observation:
        """Return the current observation, (num_envs, …) for each key: arrays that are never written again."""
        if self.vector_reads is not None:
            return _join(self.vector_reads)
        return {
            key: np.array(reads[0](), self._images[key]) if key in self._images else _join(reads)
            for key, reads in self._reads.items()
        }

    def check(self) -> None:
        """Check that every term reads an array of its shape.

        Raises:
            ConfigurationError: One does not.
        """
        for name, term in self.terms.items():
            shape, wanted = np.shape(term.read()), (self._num_envs, *term.low.shape)
            if shape != wanted:
                raise ObservationTermError(name, f"reads an array of shape {shape}; its bounds require {wanted}.")

    def describe(self) -> list[dict[str, Any]]:
        """Return a row for each vector under ``"observation"``: name, first and last column, unit and suggested scale."""
        return [
            {
                "name": name,
                "columns": [columns.start, columns.stop - 1],
                "unit": self.terms[name].unit,
                "scale": self.terms[name].scale,
            }
            for name, (key, columns) in self.columns.items()
            if key == VECTORS
        ]


def _join(reads: list[Callable[[], np.ndarray[Any, Any]]]) -> np.ndarray[Any, Any]:
    return np.concatenate([read() for read in reads], axis=1).astype(np.float32)


def _space(terms: list[ObservationTerm]) -> gym.spaces.Box:
    dtype = np.dtype(terms[0].dtype).type
    low = np.concatenate([term.low for term in terms]).astype(dtype)
    high = np.concatenate([term.high for term in terms]).astype(dtype)
    return gym.spaces.Box(low, high, dtype=dtype)

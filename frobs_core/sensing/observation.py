"""Observations, assembled from named terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.description.observation_term import VECTORS, Observation, ObservationTerm
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError


class Observations:
    """Observations of all environments, assembled from terms.

    Args:
        num_envs: ≥ 1.
        terms: Terms by name, in the order of the observation.

    Attributes:
        terms: Terms by name, in the order of the observation.
        columns: Observation key and columns of each term. For images, the columns are ``slice(None)``.
        space: Observation space of a single environment: a float32 Box if all terms have the key ``"observation"``,
            otherwise a Dict.
        vector_reads: Functions that read the terms, if the observation is a single vector. Otherwise, None.
        scale: Suggested scale factor of each column under the key ``"observation"``, (k,).

    Raises:
        ConfigurationError: There are no terms, the bounds of a term have different shapes, or an image shares its key
            with another term.
    """

    def __init__(self, num_envs: int, terms: Mapping[str, ObservationTerm]) -> None:
        self._num_envs = num_envs
        self.terms = dict(terms)
        self.columns: dict[str, tuple[str, slice]] = {}
        parts: dict[str, dict[str, ObservationTerm]] = {}
        for name, term in self.terms.items():
            if term.low.shape != term.high.shape:
                raise ConfigurationError(
                    f"the observation term '{name}' has bounds with different shapes, {term.low.shape} and "
                    f"{term.high.shape}."
                )
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
                raise ConfigurationError(
                    f"the observation term '{images[0]}' is not a float32 vector, so it cannot share the key '{key}'; "
                    "use a separate key."
                )
        spaces: dict[str, gym.Space[Any]] = {key: _space(list(part.values())) for key, part in parts.items()}
        self.space: gym.Space[Any] = spaces[VECTORS] if spaces.keys() == {VECTORS} else gym.spaces.Dict(spaces)
        vectors = parts.get(VECTORS, {}).values()
        self.scale: Floats = np.concatenate([np.zeros(0), *(np.full(len(term.low), term.scale) for term in vectors)])
        self._reads = {key: [term.read for term in part.values()] for key, part in parts.items()}
        self._images = {term.key: term.dtype for term in self.terms.values() if not term.is_vector}
        self.vector_reads = self._reads[VECTORS] if spaces.keys() == {VECTORS} else None

    def observe(self) -> Observation:
        """Return the current observation in new arrays, (num_envs, …) for each key."""
        if self.vector_reads is not None:
            return _join(self.vector_reads)
        return {
            key: np.array(reads[0](), self._images[key]) if key in self._images else _join(reads)
            for key, reads in self._reads.items()
        }

    def check(self) -> None:
        """Check that every term returns an array of the expected shape.

        Raises:
            ConfigurationError: A term returns an array of the wrong shape.
        """
        for name, term in self.terms.items():
            shape, expected = np.shape(term.read()), (self._num_envs, *term.low.shape)
            if shape != expected:
                raise ConfigurationError(
                    f"the observation term '{name}' returns an array of shape {shape}, but its bounds require the "
                    f"shape {expected}."
                )

    def describe(self) -> list[dict[str, Any]]:
        """Return the name, first and last column, unit and suggested scale of each term under ``"observation"``."""
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

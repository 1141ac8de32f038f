"""Validates observations against the spaces that a policy was trained with."""

from __future__ import annotations

from collections.abc import Mapping, Set
from pathlib import Path
from typing import NoReturn

import numpy as np

from frobs_deploy.errors import BundleMismatchError
from frobs_deploy.manifest import Manifest
from frobs_deploy.spaces import Array, Space


class ObservationReader:
    """Validates observations, and converts them to the batches that the graph accepts."""

    def __init__(self, path: Path, manifest: Manifest) -> None:
        self._path = path
        self._spaces = manifest.observation
        self._flat: Space | None = manifest.observation.get("")
        self._terms = manifest.terms

    def read(self, observation: Array | Mapping[str, Array]) -> tuple[dict[str, Array], bool, int]:
        """Validate an observation, and convert it to a batch.

        Returns:
            A tuple of the observation parts (arrays of shape (n, …), by key), whether the observation had no batch
            axis, and the batch size n.
        """
        if self._flat is not None:
            given = self._compose(observation) if isinstance(observation, Mapping) else observation
            value, single = self._batch("the observation", self._flat, given)
            return {"": value}, single, len(value)
        if not isinstance(observation, Mapping):
            self._fail(f"the observation is a single array; expected a mapping that contains {_list(self._spaces)}.")
        self._check_names(observation.keys(), self._spaces.keys())
        parts, singles = {}, set()
        for key, space in self._spaces.items():
            parts[key], single = self._batch(f"observation['{key}']", space, observation[key])
            singles.add(single)
        sizes = {len(value) for value in parts.values()}
        if len(singles) > 1 or len(sizes) > 1:
            self._fail(f"the parts of the observation are batches of different sizes: {sorted(sizes)}.")
        return parts, singles.pop(), sizes.pop()

    def _batch(self, what: str, space: Space, given: Array) -> tuple[Array, bool]:
        try:
            value = given if isinstance(given, np.ndarray) else np.asarray(given)
        except ValueError:
            self._fail(f"the rows of {what} differ in length.")
        single = value.ndim == len(space.shape)
        value = value[None] if single else value
        complaint = space.complaint(value)
        if complaint is None and not len(value):
            complaint = "is an empty batch"
        if complaint is not None:
            self._fail(f"{what} {complaint}.")
        return value, single

    def _compose(self, terms: Mapping[str, Array]) -> Array:
        """Build the flat observation from a mapping of named terms, which may have any float type."""
        assert self._flat is not None
        if sum(columns.stop - columns.start for columns in self._terms.values()) != (self._flat.shape or (0,))[0]:
            self._fail("the bundle does not name all terms of the observation; pass the observation as a single array.")
        self._check_names(terms.keys(), self._terms.keys())
        try:
            pieces = {name: np.asarray(terms[name], self._flat.dtype) for name in self._terms}
        except (TypeError, ValueError, OverflowError) as error:
            self._fail(f"a term of the observation contains a value that is not a number: {error}.")
        leading = {piece.shape[:-1] for piece in pieces.values()}
        for name, columns in self._terms.items():
            width = columns.stop - columns.start
            if pieces[name].shape[-1:] != (width,) or pieces[name].ndim > 2 or len(leading) > 1:
                self._fail(f"observation['{name}'] has shape {pieces[name].shape}, not ({width},).")
        flat = np.empty((*leading.pop(), *self._flat.shape), self._flat.dtype)
        for name, columns in self._terms.items():
            flat[..., columns] = pieces[name]
        return flat

    def _check_names(self, given: Set[str], needed: Set[str]) -> None:
        if given != needed:
            lacks, extra = sorted(needed - given), sorted(given - needed)
            said = [f"lacks {_list(lacks)}"] * bool(lacks) + [f"contains the unknown {_list(extra)}"] * bool(extra)
            self._fail(f"the observation {' and '.join(said)}; expected {_list(needed)}.")

    def _fail(self, reason: str) -> NoReturn:
        raise BundleMismatchError(self._path, reason)


def _list(names: Mapping[str, object] | Set[str] | list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)

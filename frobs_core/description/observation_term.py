"""Terms of an observation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

Observation: TypeAlias = np.ndarray[Any, Any] | dict[str, np.ndarray[Any, Any]]
"""Batched observation: an array (num_envs, …), or a dictionary of such arrays."""


VECTORS = "observation"
"""Key of the vector terms in a dictionary observation. An observation that consists of a single array is also named
``"observation"``.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservationTerm:
    """One named part of an observation.

    Attributes:
        read: Function that returns the current value, (num_envs, …). The environment copies the array.
        low: Minimum values, with the shape of a single environment's value.
        high: Maximum values, with the same shape as ``low``.
        unit: Unit of the values, such as ``"m"``.
        scale: Suggested scale factor for learning algorithms. After scaling, a change that matters for the task is
            about 1.
        key: Key in a dictionary observation. Vectors with the same key are concatenated in the order of the terms.
        dtype: ``"float32"`` for vectors. An image may have another data type, and needs its own key.
        imperfect: Whether the term reads a sensor that has its own noise, delay or other imperfections. For such terms,
            ``randomize`` rejects additional noise and delays.
        proprioceptive: Whether the robot itself can measure the value: the states of its joints, tool and gripper, the
            readings of its sensors, and the previous action. Data sets store these terms as the state of the robot.
        view: Camera settings of an image, which are stored in exported policies: name of the ``camera``, the fields of
            :class:`~frobs_core.description.Camera`, the ``modality``, and whether ``markers`` are drawn.
    """

    read: Callable[[], np.ndarray[Any, Any]]
    low: np.ndarray[Any, Any]
    high: np.ndarray[Any, Any]
    unit: str
    scale: float = 1.0
    key: str = VECTORS
    dtype: str = "float32"
    imperfect: bool = False
    proprioceptive: bool = False
    view: Mapping[str, Any] | None = None

    @property
    def is_vector(self) -> bool:
        """Whether the term can be concatenated with other terms."""
        return self.low.ndim == 1 and self.dtype == "float32"

"""Attributes of the base class of manipulation tasks that tasks of version 0.2 use, kept until version 0.4."""

from __future__ import annotations

from functools import reduce
from operator import add
from typing import Any, TypeVar, cast

import numpy as np

from frobs_core.contracts import StepContext, Task
from frobs_core.deprecation import renamed_attribute, warn_deprecated
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.random import RandomSource
from frobs_tasks_manipulation import working_area

C = TypeVar("C", bound=type[Task])

_RENAMED = {
    "tcp": "tool.pos",
    "tcp_velocity": "tool.velocity",
    "opening": "tool.opening",
    "gripper": "tool.gripper",
    "tool_terms": "tool.terms",
    "draw_place": "working_area.draw",
}
"""Attributes that moved to a part of the task, by their names in version 0.2."""


def keep_names_of_0_2(cls: C) -> C:
    """Keep the attributes of a base class that tasks of version 0.2 read, and their dense reward ``_dense_terms``."""
    for old, new in _RENAMED.items():
        setattr(cls, old, renamed_attribute(old, new))
    for method in (checked_place, draw_turn):
        setattr(cls, method.__name__, method)

    def init_subclass(subclass: Any, /, **kwargs: Any) -> None:
        super(cast("Any", cls), subclass).__init_subclass__(**kwargs)
        if "_dense_terms" in vars(subclass) and "rewards" not in vars(subclass):
            what, instead = f"{subclass.__qualname__}._dense_terms", "the table 'rewards' of the class"
            warn_deprecated(what, instead=instead, since="0.3", removed_in="0.4", stacklevel=3)
            subclass.reward_types = vars(subclass).get("reward_types", ("dense", "sparse"))
            subclass.reward = _reward

    cls.__init_subclass__ = classmethod(init_subclass)  # type: ignore[assignment]
    return cls


def checked_place(task: Any, option: str, place: Floats, lowest: float) -> Floats:
    """Validate and return positions that were passed to ``reset``, (n, 3) [m]."""
    what = f"{type(task).__qualname__}.checked_place"
    warn_deprecated(what, instead="working_area.chosen", since="0.3", removed_in="0.4")
    checked: Floats = task.working_area.chosen(option, {option: place}, place, lowest)
    return checked


def draw_turn(task: Any, stream: str, rng: RandomSource, mask: Mask | None) -> Floats:
    """Draw orientations of an object on the floor, (n, 4)."""
    what = f"{type(task).__qualname__}.draw_turn"
    warn_deprecated(what, instead=f"{working_area.__name__}.draw_turn", since="0.3", removed_in="0.4")
    return working_area.draw_turn(stream, rng, mask)


def _reward(task: Any, context: StepContext) -> Floats:
    if task.reward_type == "sparse":
        task._reward_terms = {"unachieved": np.where(task.achieved, 0.0, -1.0)}
    else:
        task._reward_terms = dict(task._dense_terms())
    return reduce(add, task._reward_terms.values())

"""Reward terms as data: formulas, weights, and what a task derives from them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from frobs_core.contracts import Task
from frobs_core.description import Rewards, RewardTerm

DISTANCE = RewardTerm(function=lambda task: task.distance, weight="-scale", meaning="d, where d is far", unit="m")
REACHED = RewardTerm(function=lambda task: task.distance < 1.0, weight=0.5, meaning="1 if d < 1 m")


class Reaching(Task):
    """A task.

    {rewards}

    Args:
        none: None.
    """

    rewards: ClassVar[Rewards] = {
        "dense": {"distance": DISTANCE, "reached": REACHED},
        "sparse": {"reached": RewardTerm(function=REACHED.function, meaning="1 if d < 1 m")},
    }
    scale = 2.0
    distance = np.array([0.5, 3.0])

    def bind(self, simulation: Any, control: Any, control_timestep: float) -> None: ...

    def reset(self, mask: Any, rng: Any, options: Any) -> None: ...

    def observation_terms(self) -> Any: ...

    def is_success(self) -> Any: ...


def as_in(reward_type: str) -> Reaching:
    task = Reaching()
    task.reward_type = reward_type
    return task


@pytest.mark.parametrize(
    ("weight", "meaning", "unit", "formula"),
    [
        (0.2, "1 − tanh(d / 0.2 m), where d is far", "1", "0.2 · (1 − tanh(d / 0.2 m)), where d is far"),
        (0.4, "max(1 − d, 0)", "1", "0.4 · max(1 − d, 0)"),
        (0.5, "1 if it is there", "1", "0.5 if it is there"),
        ("-cost", "1 at every step", "1", "−cost at every step"),
        (-1.0, "d, where d is far", "m", "−d, where d is far [m]"),
        (1.0, "−1 unless it is there, otherwise 0", "1", "−1 unless it is there, otherwise 0"),
        (1.0, "a + b", "1", "a + b"),
    ],
)
def test_a_formula_is_the_meaning_with_the_weight(weight: Any, meaning: str, unit: str, formula: str) -> None:
    assert RewardTerm(function=np.abs, weight=weight, meaning=meaning, unit=unit).formula == formula


def test_a_weight_can_be_an_attribute_of_the_task() -> None:
    assert DISTANCE.weight_in(SimpleNamespace(scale=3)) == -3.0
    assert REACHED.weight_in(None) == 0.5


def test_a_reward_is_the_weighted_sum_of_its_terms() -> None:
    task = as_in("dense")
    assert task.reward_terms() == {}
    assert task.reward(None).tolist() == [-0.5, -6.0]  # type: ignore[arg-type]
    assert {name: term.tolist() for name, term in task.reward_terms().items()} == {
        "distance": [-1.0, -6.0],
        "reached": [0.5, 0.0],
    }
    assert as_in("sparse").reward(None).tolist() == [1.0, 0.0]  # type: ignore[arg-type]


def test_reward_types_meanings_and_the_docstring_come_from_the_table() -> None:
    assert Reaching.reward_types == ("dense", "sparse")
    assert Reaching.reward_meanings == {
        "distance": "−scale · d, where d is far [m]",
        "reached": "0.5 if d < 1 m (sparse: 1 if d < 1 m)",
    }
    assert "    - ``dense`` is the sum of\n\n      - ``distance``: −scale · d, where d is far [m]\n" in str(
        Reaching.__doc__
    )


def test_markup_in_a_meaning_is_escaped_in_the_docstring_only():
    class Turned(Reaching):
        """{rewards}"""

        rewards: ClassVar[Rewards] = {"dense": {"turn": RewardTerm(function=lambda task: task.a, meaning="|a| * b")}}

    assert "``turn``: \\|a\\| \\* b" in (Turned.__doc__ or "")
    assert Turned.reward_meanings == {"turn": "|a| * b"}

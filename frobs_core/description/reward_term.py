"""Terms of a reward."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from frobs_core.util.arrays import Floats


@dataclass(frozen=True, kw_only=True)
class RewardTerm:
    """One term of a reward, which is a weighted sum of terms.

    Attributes:
        function: Pure function that takes the task and returns the term without its weight, (num_envs,).
        weight: Factor by which the value is multiplied. Instead of a number, it can be the name of the task's attribute
            that holds the factor. A name with ``-`` in front stands for the negative value.
        meaning: The function's formula in words and symbols, without the weight, such as ``"1 − tanh(d / 0.2 m), where
            d is the distance from the tool to the cube"``, or ``"1 if the cube is at the goal"``.
        unit: Unit of the function's value.
    """

    function: Callable[[Any], Floats]
    weight: float | str = 1.0
    meaning: str
    unit: str = "1"

    def weight_in(self, task: Any) -> float:
        """Return the weight, which may be an attribute of the task."""
        if not isinstance(self.weight, str):
            return self.weight
        value = float(getattr(task, self.weight.removeprefix("-")))
        return -value if self.weight.startswith("-") else value

    @property
    def formula(self) -> str:
        """The meaning with the weight in front, such as ``"0.2 · (1 − tanh(d / 0.2 m)), where d is …"``."""
        weight = (self.weight if isinstance(self.weight, str) else f"{self.weight:g}").replace("-", "−")
        value, condition = re.fullmatch(r"(.*?)((?:, where|;| if| unless| at).*)?", self.meaning).groups("")  # type: ignore[union-attr]
        is_sum = re.search(" [+−] ", re.sub(r"\(.*\)", "", value)) is not None  # outside parentheses
        if weight != "1" and is_sum:
            value = f"({value})"
        elif value == "1" and weight != "1":
            weight, value = "", weight
        factor = {"": "", "1": "", "−1": "−"}.get(weight, f"{weight} · ")
        return f"{factor}{value}{condition}" + ("" if self.unit == "1" else f" [{self.unit}]")


Rewards: TypeAlias = Mapping[str, Mapping[str, RewardTerm]]
"""Terms of each reward type, by reward type and name."""


def reward_meanings(rewards: Rewards) -> dict[str, str]:
    """Return the formula of each term, by name. If reward types define a term differently, all formulas are listed."""
    meanings: dict[str, str] = {}
    for reward_type, terms in rewards.items():
        for name, term in terms.items():
            known = meanings.setdefault(name, term.formula)
            if term.formula != known:
                meanings[name] = f"{known} ({reward_type}: {term.formula})"
    return meanings


def with_rewards(docstring: str, rewards: Rewards) -> str:
    """Return a docstring in which a line ``{rewards}`` is replaced by a list of all terms.

    Characters that would be markup in the documentation, such as those of ``|x|``, are escaped.
    """
    items = [
        f"- ``{reward_type}`` is the sum of\n\n"
        + "\n".join(f"  - ``{name}``: " + re.sub(r"[|*`]", r"\\\g<0>", term.formula) for name, term in terms.items())
        for reward_type, terms in rewards.items()
    ]
    text = "\n\n".join(items)
    return re.sub(r"^( *)\{rewards\}$", lambda line: textwrap.indent(text, line[1]), docstring, flags=re.MULTILINE)

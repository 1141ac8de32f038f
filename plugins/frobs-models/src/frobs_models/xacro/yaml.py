"""Loads the YAML files that xacro expressions refer to. Only plain data and xacro's units are supported."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from frobs_core.util.budgets import BUDGETS
from frobs_core.util.files import read_limited
from frobs_core.util.yaml import LimitedLoader
from frobs_models.xacro.library import YamlDict
from frobs_models.xacro.limits import Budget

_UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180.0,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}
_MAX_MERGED = 10_000
_MAX_MERGES = 100


def load_yaml(path: Path, budget: Budget, evaluate: Callable[[str], Any]) -> Any:
    """Return the content of a YAML file. Keys of mappings can also be accessed as attributes.

    Args:
        path: The file.
        budget: Counter for the values.
        evaluate: Function that evaluates the expression after a unit tag, as in ``!degrees 90 / 2``.

    Raises:
        OSError: The file cannot be read, or is larger than the limit.
        ModelFileError: A limit is exceeded.
        yaml.YAMLError: The file is not valid YAML, or has a tag that is not a unit.
        ValueError: The file contains only text, or a value that is not plain data.
    """
    data = read_limited(path, BUDGETS["YAML file"]["bytes"])
    budget.spend(len(data) // 4)

    class Loader(LimitedLoader):
        def flatten_mapping(self, node: yaml.MappingNode) -> None:
            """Merge ``<<`` keys, but limit the resulting size, because each merge could double the size of a mapping."""
            for key, value in node.value:
                if key.tag == "tag:yaml.org,2002:merge" and len(getattr(value, "value", ())) > _MAX_MERGES:
                    budget.refuse(f"{path} exceeds the limit of {_MAX_MERGES} merged mappings")
            super().flatten_mapping(node)
            if len(node.value) > _MAX_MERGED:
                budget.refuse(f"{path} exceeds the limit of {_MAX_MERGED:,} merged keys")

    def constructor(factor: float) -> Callable[[Any, yaml.Node], float]:
        return lambda loader, node: float(evaluate(loader.construct_scalar(node))) * factor

    for tag, factor in _UNITS.items():
        Loader.add_constructor(tag, constructor(factor))
    loader = Loader(data.decode("utf-8-sig"))
    try:
        content = loader.get_single_data()
        if isinstance(content, str):  # YAML reads plain text as a single string
            raise ValueError(f"{path} contains neither a mapping nor a list")
        return _plain(content, budget, 0)
    finally:
        loader.dispose()


def _plain(value: Any, budget: Budget, depth: int) -> Any:
    """Return plain data. Aliases are expanded so that nested aliases also count toward the budget."""
    budget.spend(1)
    budget.meter.check("levels of nested lists", depth)
    if isinstance(value, dict):
        return YamlDict({_plain(key, budget, depth): _plain(item, budget, depth + 1) for key, item in value.items()})
    if isinstance(value, (list, tuple, set)):
        return type(value)(_plain(item, budget, depth + 1) for item in value)
    if isinstance(value, datetime.date):
        return str(value)
    if isinstance(value, str):
        budget.check_length(len(value))
    elif isinstance(value, int):
        budget.weigh(value)
    elif value is not None and not isinstance(value, float):
        raise ValueError(f"a YAML file contains a {type(value).__name__}, which is not plain data")
    return value

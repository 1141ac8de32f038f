"""Writes the plugin's ``original.py``, which contains the spaces and parameters of the old package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from frobs_core.util.plain import plain
from frobs_rl_compat.migrate.migration import Migration
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.yaml_files import literal

_WIDTH = 114  # maximum length of a line, excluding its indentation and a trailing comma
_SPACES = {"ACTION_SPACE": "self.action_space", "OBSERVATION_SPACE": "self.observation_space"}


def write_original(package: OldPackage, folder: Path, made: Migration) -> None:
    """Write ``original.py`` into a folder."""
    parts = [
        f'"""Values from the source code of {package.lineage[0].name} in the ROS package {package.name}.\n\n'
        'No other module uses this file, which is a reference for porting the task.\n"""\n\n'
    ]
    spaces = [_space(package, name, attribute, made) for name, attribute in _SPACES.items()]
    uses_gym = any("gym." in text for text in spaces)
    uses_numpy = any("np." in text for text in spaces)
    imports = (["import gymnasium as gym"] if uses_gym else []) + (["import numpy as np"] if uses_numpy else [])
    parts += ["\n".join(imports) + "\n\n"] if imports else []
    parts += [f"{text}\n" for text in spaces]
    for path, mapping in package.yaml.numbers.items():
        shown = path.relative_to(package.folder).as_posix()
        parts.append(f"\n{_constant(path.stem)} = {literal(plain(mapping, for_yaml=True))}  # {shown}\n")
        made.carry(f"numbers of {shown}", f"original.py: {_constant(path.stem)}")
    values = package.constructed.parameters
    if values:
        parts.append(f"\nROBOT_PARAMETERS = {literal(values)}  # of RobotBasicEnv\n")
        made.carry(f"{len(values)} parameters of RobotBasicEnv", "original.py: ROBOT_PARAMETERS")
    for name, expression in package.constructed.unknown_parameters.items():
        made.leave(f"{name} of RobotBasicEnv", f"the value of the argument is known only at run time: {expression}")
    (folder / "original.py").write_text("".join(parts), "utf-8")


def _space(package: OldPackage, name: str, attribute: str, made: Migration) -> str:
    space = package.constructed.values.get(attribute)
    if isinstance(space, gymnasium.Space):
        made.carry(attribute.removeprefix("self."), f"original.py: {name}")
        return f"{name} = {_space_text(space)}"
    expression, missing = package.constructed.unknown.get(attribute, ("it is not set", ""))
    made.leave(attribute.removeprefix("self."), f"its value is unknown: {missing or expression}")
    text = " ".join(expression.split())
    return f"{name} = None  # TODO: {text[:80]}{'…' if len(text) > 80 else ''}"


def _space_text(space: gymnasium.Space[Any]) -> str:
    if isinstance(space, gymnasium.spaces.Box):
        bounds = "".join(f"    {name}={_bound(getattr(space, name), len(name))},\n" for name in ("low", "high"))
        return f"gym.spaces.Box(\n{bounds}    dtype=np.{space.dtype},\n)"
    if isinstance(space, gymnasium.spaces.MultiDiscrete):
        return f"gym.spaces.MultiDiscrete({space.nvec.tolist()})"
    return f"gym.spaces.{space}"


def _bound(values: np.ndarray[Any, Any], already: int) -> str:
    """Format a ``Box`` bound as a code formatter would, either on one line or with one argument per line."""
    numbers, dtype = _numbers(values.tolist()), f"dtype=np.{values.dtype}"
    line = f"np.array({numbers}, {dtype})"
    if already + len(line) <= _WIDTH:
        return line
    if len(numbers) > _WIDTH - 4 and values.ndim == 1:
        rows = "".join(f"            {_numbers(value)},\n" for value in values.tolist())
        numbers = f"[\n{rows}        ]"
    return f"np.array(\n        {numbers},\n        {dtype},\n    )"


def _numbers(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_numbers(item) for item in value) + "]"
    return f"{value:.7g}".replace("inf", "np.inf")


def _constant(stem: str) -> str:
    text = "".join(character if character.isalnum() else "_" for character in stem).upper()
    return text if text[:1].isalpha() else f"NUMBERS_{text}"

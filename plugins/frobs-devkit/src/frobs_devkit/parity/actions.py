"""Action files, which contain the actions to replay in an environment on every simulator."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.files import write_aside, write_json


class ActionFileError(ConfigurationError):
    """An action file cannot be read, or does not match the environment. The reason says how to fix it."""

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{path}: {reason}")


SUFFIXES = (".json", ".npz")
"""Suffixes of action files."""

_AMPLITUDE = 0.5  # amplitude as a fraction of the action range, small enough for an arm to move freely


@dataclass(frozen=True, kw_only=True)
class ActionFile:
    """Sequence of actions for one episode of an environment.

    Attributes:
        id: Gymnasium ID of the environment.
        seed: Seed for the reset at the beginning of the episode.
        actions: Actions from the environment's action space, (steps, …).
        controller: Name of the controller that the actions require, or ``""`` for the environment's controller.
    """

    id: str
    seed: int
    actions: np.ndarray[Any, Any]
    controller: str = ""

    def write(self, path: Path) -> None:
        """Write the actions to a file, in the format that its suffix specifies: ``.json`` or ``.npz``.

        Raises:
            ConfigurationError: The suffix is not supported.
        """
        content = {"id": self.id, "seed": self.seed, "controller": self.controller, "actions": self.actions}
        match path.suffix:
            case ".json":
                write_json(path, {**content, "actions": self.actions.tolist()})
            case ".npz":
                write_aside(path, lambda aside: np.savez(aside, **content))  # type: ignore[arg-type]
            case _:
                raise ActionFileError(path, f"an action file must have the suffix {' or '.join(SUFFIXES)}.")


def read_actions(path: Path) -> ActionFile:
    """Read an action file without executing any code that it may contain.

    Raises:
        ConfigurationError: The file cannot be read, or is incomplete.
    """
    try:
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as content:
                stored: Any = {name: content[name] for name in content.files}
        elif path.suffix == ".json":
            stored = json.loads(path.read_text("utf-8"))
        else:
            raise ActionFileError(path, f"an action file must have the suffix {' or '.join(SUFFIXES)}.")
    except FileNotFoundError as error:
        raise ActionFileError(path, "the file does not exist.") from error
    except (OSError, ValueError, UnicodeDecodeError) as error:  # ValueError: not JSON, or a pickle
        raise ActionFileError(path, f"the file is not a valid action file: {error}") from error
    missing = [name for name in ("id", "seed", "actions") if not isinstance(stored, dict) or name not in stored]
    if missing:
        raise ActionFileError(
            path,
            f"missing from the file: {', '.join(missing)}; an action file must contain 'id', 'seed' and 'actions' "
            "(steps, …), and may contain 'controller'.",
        )
    try:
        seed = int(stored["seed"])
        actions = np.asarray(stored["actions"])
        if not np.issubdtype(actions.dtype, np.number):
            raise ValueError(f"actions are {actions.dtype}, not numbers")
    except (TypeError, ValueError) as error:  # ragged lists, strings
        raise ActionFileError(path, f"the seed or the actions are not numbers: {error}") from error
    return ActionFile(
        id=str(stored["id"]), seed=seed, actions=actions, controller=str(stored.get("controller", "") or "")
    )


def check_actions(file: ActionFile, env: RobotEnv, id: str, controller: str, where: str) -> None:
    """Raise ActionFileError unless an action file matches an environment with the given ID and controller.

    The error message begins with ``where``, the file or other source of the actions.
    """
    space, actions = env.action_space, file.actions
    if file.id.removeprefix("frobs_core:") != id.removeprefix("frobs_core:"):
        raise ActionFileError(
            where, f"the actions are for '{file.id}', not for '{id}'; use frobs parity {file.id} --actions …"
        )
    if file.controller and file.controller != controller:
        raise ActionFileError(
            where,
            f"the actions are for the controller '{file.controller}', not for '{controller}'; use --controller "
            f"{file.controller}",
        )
    if file.seed < 0:
        raise ActionFileError(where, f"the seed must be at least 0, but it is {file.seed}.")
    action_shape = space.shape or ()
    if actions.ndim != 1 + len(action_shape) or actions.shape[1:] != action_shape or not len(actions):
        raise ActionFileError(
            where, f"the actions have the shape {actions.shape}, but '{id}' requires {('steps', *action_shape)}."
        )
    if isinstance(space, gym.spaces.Box):
        if not np.isfinite(actions).all():
            step = int(np.argwhere(~np.isfinite(actions))[0][0])
            raise ActionFileError(where, f"the action at step {step} contains NaN or an infinite value.")
    else:
        for step, action in enumerate(actions):
            if not space.contains(np.asarray(action, np.int64)):
                raise ActionFileError(
                    where, f"the action at step {step} is {action}, which is outside the action space {space}."
                )


def smooth_actions(space: gym.Space[Any], steps: int, seed: int) -> np.ndarray[Any, Any]:
    """Return oscillating actions (steps, …) for a ``Box`` space, or random actions for any other space.

    Each element of the actions oscillates with a different period, which is drawn with the seed.
    """
    if not isinstance(space, gym.spaces.Box):
        space.seed(seed)
        return np.array([space.sample() for _ in range(steps)])
    rng = np.random.default_rng(seed)
    cycles, signs = rng.uniform(2.0, 5.0, space.shape), rng.choice((-1.0, 1.0), space.shape)
    time = np.linspace(0.0, 2.0 * math.pi, steps, endpoint=False).reshape(steps, *(1 for _ in space.shape))
    # Limit wide and unbounded spaces to [-1, 1].
    low, high = np.maximum(space.low, -1.0), np.minimum(space.high, 1.0)
    # The actions are cosines, so their integrals are sines, which extend to both sides of the start.
    swing: np.ndarray[Any, Any] = (high + low) / 2.0 + _AMPLITUDE * (high - low) / 2.0 * signs * np.cos(cycles * time)
    return swing

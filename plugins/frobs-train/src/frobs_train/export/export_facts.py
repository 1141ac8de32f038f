"""Collect the facts about a policy that are stored in its bundle."""

from __future__ import annotations

import hashlib
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.kernel.compose import parameter_defaults
from frobs_core.models import JointType
from frobs_core.plugins import registry
from frobs_core.util.errors import ConfigurationError, PluginError, PolicyExportError, RunError
from frobs_core.util.files import read_json
from frobs_core.util.plain import plain, to_json
from frobs_deploy import space_to_json
from frobs_models import fingerprint
from frobs_train.configuration.command import training_command
from frobs_train.configuration.config import RunConfig
from frobs_train.logs.progress import STEPS, read_progress
from frobs_train.runs.run import Run
from frobs_train.runs.versions import versions

_SPDX = re.compile(r"[A-Za-z0-9][A-Za-z0-9.+-]*( (AND|OR|WITH) [A-Za-z0-9][A-Za-z0-9.+-]*)*")
_PARTS = ("task", "robot", "controller", "simulator")
_CURVE = 60  # number of points in a learning curve, enough for a small plot
_NO_LICENSE = "No license was given for this policy; ask its author before you distribute it.\n"


def environment_facts(env: gym.vector.VectorEnv[Any, Any, Any], config: RunConfig) -> dict[str, Any]:
    """Return facts about the policy's environment, robot, controller, action and observation."""
    base: Any = env.unwrapped
    base = base.envs[0].unwrapped if hasattr(base, "envs") else base  # single environments are identical
    ours = isinstance(getattr(base, "robot", None), RobotHandle)
    controller, observations = (base.controller, base.observations) if ours else (None, None)
    keywords = vars(base.config) if ours else config.environment_kwargs
    names = {part: name for part in _PARTS if isinstance(name := keywords.get(part), str)}
    timestep = getattr(base, "control_timestep", None)
    changes = None if controller is None else controller.max_action_change
    if controller is not None and env.single_action_space != controller.action_space:  # a wrapper changes the actions
        changes = None
    # a wrapper may change the observations
    shown = observations if observations and env.single_observation_space == observations.space else None
    pictures = shown.terms.values() if shown else ()
    spaces = spaces_facts(env.single_observation_space, env.single_action_space)
    return {
        "environment": {
            "id": config.environment,
            "keywords": plain(config.environment_kwargs),
            "parameters": plain(_parameters(config)),
            "task": names.get("task"),
            "simulator": names.get("simulator"),
            "wrappers": plain([wrapper.model_dump() for wrapper in config.wrappers]),
            "max_episode_steps": env.spec.max_episode_steps if env.spec is not None else None,
        },
        "control_timestep": None if timestep is None else float(timestep),
        "robot": _robot(base.robot, names, config) if ours else None,
        "controller": None
        if controller is None
        else {
            "name": names.get("controller"),
            "command": controller.command_mode.value,
            "parameters": plain({**parameter_defaults(type(controller)), **base.config.controller_kwargs}),
            "laws": plain([one.law() for one in base.control.controllers.values()]),
        },
        "action": {
            "space": spaces["action"],
            "max_change": None if changes is None else plain(np.asarray(changes, float).ravel()),
        },
        "observation": {
            "spaces": spaces["observation"],
            "terms": [{key: row[key] for key in ("name", "columns", "unit")} for row in shown.describe()]
            if shown
            else [],
            "images": {term.key: {**plain(term.view), "unit": term.unit} for term in pictures if term.view is not None},
        },
    }


def spaces_facts(observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> dict[str, Any]:
    """Return the observation spaces, by key, and the action space of one environment in the bundle format."""
    parts = observation_space.spaces if isinstance(observation_space, gym.spaces.Dict) else {"": observation_space}
    return {"observation": {key: _space(space) for key, space in parts.items()}, "action": _space(action_space)}


def training_facts(run: Run, steps: int) -> dict[str, Any]:
    """Return facts about the policy's training: algorithm, configuration, seed, time, results and versions."""
    config = plain(run.config.model_dump())
    trained = run.path / "versions.json"
    curve = learning_curve(run, steps)
    return {
        "training": {
            "algorithm": run.config.algorithm,
            "steps": steps,
            "seed": run.config.seed,
            "seconds": curve["seconds"][-1] if curve["seconds"] else None,
            "command": None if run.changes else training_command(run.config),
            "curve": curve,
            "config": config,
            "config_sha256": hashlib.sha256(to_json(config, sort_keys=True).encode()).hexdigest(),
            "versions": _read_versions(trained),
            "evaluations": [plain(evaluation) for evaluation in run.evaluations() if evaluation.get("steps") == steps],
        },
        "export": {"versions": versions(), "commit": _commit(run.path)},
    }


def _read_versions(path: Path) -> dict[str, Any] | None:
    try:
        return read_json(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise RunError(f"{path} cannot be read: {error.strerror}; remove the file.") from error


def learning_curve(run: Run, steps: int) -> dict[str, list[Any]]:
    """Return a coarse learning curve up to a checkpoint: ``steps``, ``seconds``, mean ``reward`` and ``success``."""
    path = run.path / "progress.csv"
    columns = {name: np.array(values) for name, values in (read_progress(path) if path.is_file() else {}).items()}
    rows = np.flatnonzero(columns.get(STEPS, np.empty(0)) <= steps)
    elapsed = columns.get("time/elapsed", np.zeros(len(columns.get(STEPS, ()))))
    curve: dict[str, list[Any]] = {"steps": [], "seconds": [], "reward": [], "success": []}
    for part in np.array_split(rows, min(len(rows), _CURVE)) if len(rows) else []:
        curve["steps"].append(int(columns[STEPS][part[-1]]))
        curve["seconds"].append(round(float(elapsed[part[-1]]), 2))
        for name in ("reward", "success"):
            values = columns[f"episode/{name}"][part] if f"episode/{name}" in columns else np.empty(0)
            known = values[np.isfinite(values)]
            curve[name].append(float(f"{known.mean():.5g}") if len(known) else None)
    return curve


def license_text(license: str | None) -> str:
    """Return the text of the bundle's ``LICENSE`` for an SPDX expression, the path of a text file, or None."""
    if license is None:
        return _NO_LICENSE
    path = Path(license)
    if path.is_file():
        try:
            text = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigurationError(f"the license {license} cannot be read: {error}.") from error
        if text.strip():
            return text
        raise ConfigurationError(f"the license {license} is empty.")
    if not _SPDX.fullmatch(license):
        raise ConfigurationError(
            f"the license '{license}' is neither an existing file nor an SPDX identifier such as 'MIT'."
        )
    return f"SPDX-License-Identifier: {license}\n"


def _parameters(config: RunConfig) -> Mapping[str, Any]:
    """Return the keyword arguments registered with the environment ID, or an empty mapping for other packages' IDs."""
    try:
        return registry.find_environment(config.environment.rpartition(":")[2])[1].parameters
    except PluginError:
        return {}


def _robot(robot: RobotHandle, names: Mapping[str, Any], config: RunConfig) -> dict[str, Any]:
    model = robot.model
    limits = {
        "position_lower": robot.position_lower,
        "position_upper": robot.position_upper,
        "velocity": robot.velocity_limit,
        "effort": robot.effort_limit,
        "home": robot.home,
    }
    joints = []
    for i, joint in enumerate(model.actuated_joints):
        unit, force = ("m", "N") if joint.type is JointType.PRISMATIC else ("rad", "N·m")
        units = {"position": unit, "velocity": f"{unit}/s", "effort": force}
        joints.append(
            {"name": joint.name, "units": units, **{key: plain(values[0, i]) for key, values in limits.items()}}
        )
    return {
        "name": Path(str(names.get("robot") or robot.robot.name)).name,
        "model": model.path.name,
        "fingerprint": fingerprint(model),
        "xacro_args": {str(key): str(value) for key, value in robot.robot.xacro_args.items()},
        "base": robot.robot.base,
        "tcp": robot.tcp,
        "joints": joints,
    }


def _space(space: gym.Space[Any]) -> dict[str, Any]:
    if isinstance(space, gym.spaces.Box):
        low, high = space.low, space.high
    elif isinstance(space, gym.spaces.Discrete):
        low, high = np.array(space.start), np.array(space.start + space.n - 1)
    elif isinstance(space, gym.spaces.MultiDiscrete):
        low, high = space.start, space.start + space.nvec - 1
    elif isinstance(space, gym.spaces.MultiBinary):
        low, high = np.zeros(space.shape), np.ones(space.shape)
    else:
        raise PolicyExportError("the policy", f"its space {space} is not supported.")
    assert space.dtype is not None
    return space_to_json(type(space).__name__, space.shape or (), np.dtype(space.dtype), low, high)


def _commit(folder: Path) -> dict[str, Any] | None:
    """Return the commit of the Git repository that contains the run, and whether the repository is clean.

    Return None if the run is not in a Git repository.
    """

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(folder), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()

    try:
        return {"commit": git("rev-parse", "HEAD"), "clean": not git("status", "--porcelain", "--untracked-files=no")}
    except (OSError, subprocess.SubprocessError):
        return None

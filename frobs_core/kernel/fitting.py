"""Fits a task to robots that are passed as model files."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from frobs_core.contracts.task import Fitted
from frobs_core.description import ALL, Robot
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.robot_config import RobotConfig, find_record
from frobs_core.kernel.robot_file import KEYS, is_robot_file
from frobs_core.models import RobotModel, default_tcp
from frobs_core.models.load import find_reader
from frobs_core.plugins.records import ControllerDefaults, TaskRecord
from frobs_core.util.attributes import load_attribute
from frobs_core.util.errors import ConflictingOptionsError, ParameterValueError
from frobs_core.util.plain import to_json

_log = logging.getLogger("frobs")


@dataclass(kw_only=True)
class FittedRobots:
    """Robots of an environment, and what was derived from them.

    Attributes:
        configs: Configurations with settings that fit the task, by name.
        robots: Descriptions, by name.
        models: Models that were read, by name.
        grippers: Settings that state the grippers that were found, by name of the robot.
        task: Keywords of the task.
    """

    configs: dict[str, RobotConfig]
    robots: dict[str, Robot] = field(default_factory=dict)
    models: dict[str, RobotModel] = field(default_factory=dict)
    grippers: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    task: dict[str, Any] = field(default_factory=dict)


def fit_robots(task: Any, robots: Mapping[str, RobotConfig], fit: bool | None) -> FittedRobots:
    """Return the robots with settings that fit a task, their descriptions, and keywords of the task.

    Args:
        task: Class of the task.
        robots: Configurations of the robots, by name.
        fit: Whether to fit the task, or None to fit it to robots that are passed as model files.

    Raises:
        FrobsError: A robot cannot be described, has no gripper, or has no working area.
    """
    result = FittedRobots(configs=dict(robots))
    fitting: str = getattr(task, "fitting", "")
    for name, config in robots.items():
        description = config.describe()
        is_fitted = bool(fitting) and (config.from_file if fit is None else fit)
        if fitting and config.from_file and not description.groups and (is_fitted or config.gripper):
            reader = find_reader(description.model)
            result.grippers[name] = stated = reader.describe_gripper(description, config.gripper)
            description = reader.with_gripper(description, stated)
        elif config.gripper and not fitting and description.tcp is None:
            joints = dict(config.gripper).get("joints", ())  # type: ignore[arg-type] # a mapping since __post_init__
            description = replace(description, tcp=default_tcp(description.read_model(), joints))
        elif config.gripper and not config.from_file:
            rule = f"omitted for robot '{description.name}', because it describes only grippers of model files"
            raise ParameterValueError("gripper", dict(config.gripper), rule)  # type: ignore[arg-type]
        if is_fitted:
            result.models[name] = model = description.read_model()
            fitted: Fitted = load_attribute(fitting)(task, description, model)
            description = replace(description, home={**description.home, **fitted.home, **config.home})
            merged = _merged(config, description, fitted.controller)
            result.configs[name] = replace(config, controller_kwargs=merged, home=description.home)
            result.task |= fitted.task
            _log.info("the task was fitted to robot '%s': %s", description.name, _shown(fitted.task))
        result.robots[name] = description
    return result


def check_replaced(task: Any, config: EnvConfig) -> None:
    """Check that the user sets no parameter of a task that another one replaces.

    Raises:
        ConflictingOptionsError: A parameter is replaced.
    """
    given = config.task_parameters
    for name, others in ({} if config.fit is False else getattr(task, "replacing", {})).items():
        for other in others if given.get(name) is not None else ():
            if other in given:  # without ``fit: false``, no fitted parameter is among those of the user
                raise ConflictingOptionsError([name, other], f"{other} has no effect with {name}")


def fixed_keywords(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of an environment that state what is read from its robot file and derived from its robot.

    An environment with these keywords instead is the same, and does not change with the robot file or the rules of the
    derivation. Environments with several robots are fitted each time they are built.

    Args:
        keywords: All keywords of the environment, including those of its ID.

    Raises:
        FrobsError: The robot cannot be described, has no gripper, or has no working area, or a parameter of the task is
            replaced by another one.
    """
    config = EnvConfig.from_dict(keywords)
    if config.robots is not None or not isinstance(config.robot, str):
        return {}
    [robot] = config.robot_configs().values()
    found: dict[str, Any] = {}
    if is_robot_file(keywords.get("robot")):
        found = {name: value for name in KEYS if (value := getattr(config, name))}
    if not robot.from_file and not config.fit:
        return found
    task = find_record(TaskRecord, config.task).load()
    check_replaced(task, config)
    fitted = fit_robots(task, {"robot": robot}, config.fit)
    if "robot" in fitted.grippers:
        found["gripper"] = fitted.grippers["robot"]
    if fitted.task:
        chosen = fitted.configs["robot"]
        found |= {"fit": False, "home": chosen.home, "controller_kwargs": chosen.controller_kwargs}
        found |= {**fitted.task, **config.task_parameters}
    return found


def _shown(keywords: Mapping[str, Any]) -> str:
    """Return keywords as they would be passed to an environment, with rounded numbers."""
    rounded = json.loads(to_json(keywords), parse_float=lambda text: round(float(text), 4))
    return ", ".join(f"{name}={value}" for name, value in rounded.items())


def _merged(config: RobotConfig, description: Robot, fitted: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of the controllers: the user's choices, the fitted values of the arm, and the ID's values."""
    if isinstance(fitted, ControllerDefaults):
        default = description.default_controllers.get(next(iter(description.groups), ALL), "")
        fitted = fitted.of(config.controller or default)
    chosen: Mapping[str, Any] = config.controller_kwargs
    if isinstance(config.controller, Mapping):
        return {group: _over(chosen.get(group) or {}, fitted.get(group, {})) for group in {**fitted, **chosen}}
    return _over(chosen, fitted)


def _over(chosen: Mapping[str, Any], fitted: Mapping[str, Any]) -> dict[str, Any]:
    return {**chosen, **fitted} if isinstance(chosen, ControllerDefaults) else {**fitted, **chosen}

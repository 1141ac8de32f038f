"""Runs a policy on a robot in the environment that it was trained in, with the simulator ``ros``."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import gymnasium as gym

from frobs_core.kernel.compose import plan
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.env import RobotEnv
from frobs_core.plugins.records import Level
from frobs_core.plugins.registry import find_spec
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ConfigurationError
from frobs_deploy import Bundle, Policy
from frobs_ros.errors import ClockResetError, NodeEndedError
from frobs_ros.plugin import ROS

_IN_PLACE = replace(
    ROS, capabilities={**ROS.capabilities, "teleport": Level.APPROXIMATE, "contacts": Level.APPROXIMATE}
)
"""The simulator as it is here: tasks may place the robot, which stays where it is, and contacts are always open."""

_REAL_SCAN = {"rate": None, "noise": 0.0, "resolution": 0.0, "delay": 0.0, "dropout": 0.0}
"""Settings of a lidar whose scans are measured, and therefore already noisy."""


@dataclass
class Report:
    """Statistics about running a policy on a robot.

    Attributes:
        steps: Number of commands that were sent.
        late: Number of commands that were sent after the end of their own control step.
        restarts: Number of times that an episode was restarted because of a new goal or a reset of the clock.
        is_success: Whether the task was successful at the end.
    """

    steps: int = 0
    late: int = 0
    restarts: int = 0
    is_success: bool = False


def make_env(bundle: Bundle, **simulator_kwargs: Any) -> RobotEnv:
    """Return the environment that a policy was trained in, with the robot behind ROS topics. It stays where it is.

    Args:
        bundle: Bundle that contains the policy.
        **simulator_kwargs: Options of :class:`frobs_ros.robot.simulation.RosSimulation`.

    Raises:
        ConfigurationError: The policy was trained with wrappers or uses images, or an option is invalid.
        RosError: ROS or the robot does not respond.
    """
    trained = bundle.manifest["environment"]
    if trained["wrappers"]:
        raise ConfigurationError(
            f"{bundle.path} was trained with the wrappers {', '.join(map(str, trained['wrappers']))}, which policy "
            "bundles do not contain; train with the algorithm's normalization instead, and export the policy again."
        )
    images = bundle.manifest["observation"].get("images") or {}
    if images:
        names = ", ".join(f"'{name}'" for name in images)
        raise ConfigurationError(
            f"{bundle.path} uses the images {names}, but this command does not support images; run the policy with "
            "frobs_deploy.Policy and pass the images of the robot's camera to act()."
        )
    kwargs = {**_keywords(trained), "simulator_kwargs": {**simulator_kwargs, "home": False}}
    env = gym.make(f"frobs_core:{trained['id']}", disable_env_checker=True, **kwargs).unwrapped
    assert isinstance(env, RobotEnv)
    return env


def _keywords(trained: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of training, without randomization and without noise of lidars."""
    keywords = {**trained["keywords"], "simulator": _IN_PLACE}
    for name in ("randomize", "cameras", "simulator_kwargs"):
        keywords.pop(name, None)
    config = EnvConfig.from_dict({**find_spec(trained["id"]).kwargs, **keywords})
    lidars = next(iter(plan(config, 1).everything.values())).robot.lidars
    if lidars:
        sensors = config.sensors or {}
        keywords["sensors"] = {**sensors, **{name: {**(sensors.get(name) or {}), **_REAL_SCAN} for name in lidars}}
    return keywords


def act(
    env: RobotEnv,
    policy: Policy,
    *,
    clock: Callable[[], float],
    goal: Floats | None = None,
    goals: deque[Floats] | None = None,
    seconds: float | None = None,
    on_step: Callable[[Report], None] | None = None,
) -> Report:
    """Run a policy in an environment that :func:`make_env` returned.

    If the task ends the episode, for example at the goal, the robot holds its position until there is a new goal. The
    run ends when the node shuts down, when ``seconds`` have passed, or on Ctrl-C. Afterwards, closing the environment
    makes the robot hold its position.

    Args:
        env: The environment.
        policy: Policy to run.
        clock: Function that returns the robot's time [s].
        goal: Goal of the task, (3,) [m]. A wheeled robot uses only x and y. By default, the task samples a goal, which
            is used until a goal is received.
        goals: New goals, (3,) [m], to which another thread appends.
        seconds: Maximum duration according to the robot's clock [s]. Unlimited by default.
        on_step: Function that is called with the report after each step.

    Raises:
        RobotSilentError: The robot has stopped sending measurements.
    """
    report, start, missed, is_over = Report(), clock(), 0.0, False
    observation: Any = None
    while seconds is None or clock() - start < seconds:
        try:
            if goals:
                goal, observation = goals.pop(), None
                report.restarts += report.steps > 0
            if observation is None:
                options = {} if goal is None else {"goal": goal[: goal_size(env)]}
                observation, missed, is_over = env.reset(seed=0, options=options)[0], 0.0, False
                policy.reset()
            if is_over:
                env.simulation.step(env.decimation)
                continue
            observation, _, is_over, _, info = env.step(policy.act(observation))
            if is_over:
                env.robot.command(env.robot.holding_command(env.robot.joint_positions))
        except ClockResetError:
            start, observation = min(start, clock()), None
            report.restarts += 1
            continue
        except NodeEndedError:
            break
        report.steps += 1
        report.late += info.get("frobs/missed_deadlines", 0.0) > missed
        missed = info.get("frobs/missed_deadlines", 0.0)
        report.is_success = bool(info["is_success"])
        if on_step is not None:
            on_step(report)
    return report


def goal_size(env: RobotEnv) -> int:
    """Return the number of goal coordinates: 2 for a robot whose only joints are drive wheels, and 3 for others."""
    drive = env.robot.robot.differential_drive
    wheels = drive.left + drive.right if drive is not None else ()
    return 2 if set(wheels) == set(env.robot.joint_names) else 3

"""Checks that joint groups, robots and observation terms use only their own parts of actions and observations."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.testing.checks import NotApplicable, expect
from frobs_devkit.testing.compare import expect_close
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.under_test import EnvUnderTest, inside


def actions_move_their_joints(subject: EnvUnderTest) -> None:
    """Each action part affects only its joint group, and joints without a controller keep their home positions."""
    with subject.ours() as env:
        control, space = inside(env).control, env.action_space
        if len(control.controllers) == 1 or not isinstance(space, gym.spaces.Box):
            raise NotApplicable("one controller moves all joints")

        def commands(action: Floats) -> dict[str, float]:
            """Return the command of each joint for an action in the first step of an episode."""
            env.reset(seed=0)
            rows = control.commands(action[None].astype(np.float64))
            return {
                f"{name}/{joint}": float(row if command.ndim == 2 else row[-1])
                for (name, robot), command in zip(control.robots.items(), rows, strict=True)
                for joint, row in zip(robot.robot.joint_names, np.moveaxis(command[0], -1, 0), strict=True)
            }

        rest, start = commands(np.zeros(space.shape)), 0
        moved: set[str] = set()
        for name, controller in control.controllers.items():
            robot, _, group = name.partition("/")
            handle = control.robots[robot].robot
            own = {f"{robot}/{joint}" for joint in handle.robot.groups.get(group, handle.joint_names)}
            columns = slice(start, start + controller.action_space.shape[0])
            start = columns.stop
            changed = set()
            # a joint at its limit, such as a finger joint of an open gripper, can move in only one direction
            for value in (0.5, -0.5):
                action = np.zeros(space.shape)
                action[columns] = value
                changed |= {joint for joint, command in commands(action).items() if command != rest[joint]}
            expect(
                changed <= own,
                f"the action of joint group '{name}' also changes the commands of {', '.join(sorted(changed - own))}.",
            )
            expect(changed, f"the action of joint group '{name}' does not change any command.")
            moved |= own
        for name, robot in control.robots.items():
            for joint, home in zip(robot.robot.joint_names, robot.robot.home[0], strict=True):
                if f"{name}/{joint}" not in moved:
                    rest_command = rest[f"{name}/{joint}"]
                    expect_close(home, rest_command, 1e-12, f"command of joint '{joint}', which has no controller")


def terms_fill_their_columns(subject: EnvUnderTest) -> None:
    """Each observation term writes its current value to its own columns, and the columns have no gaps."""
    with subject.ours() as env:
        if inside(env).randomization is not None:
            raise NotApplicable("randomized values may be delayed")
        observations = inside(env).observations
        env.reset(seed=0)
        for action in draw_actions(env.action_space, 3, seed=0):
            observation = env.step(action)[0]
            parts = observation if isinstance(observation, dict) else {"observation": observation}
            for name, (key, columns) in observations.columns.items():
                term = observations.terms[name]
                if term.is_vector:
                    read = term.read()[0].astype(np.float32)
                    expect_close(read, parts[key][columns], 0.0, f"columns of the term '{name}'")
            for key, part in parts.items():
                width = sum(len(term.low) for term in observations.terms.values() if term.key == key and term.is_vector)
                expect(
                    width in (0, len(part)),
                    f"the observation '{key}' has {len(part)} columns, but its terms fill {width} columns.",
                )

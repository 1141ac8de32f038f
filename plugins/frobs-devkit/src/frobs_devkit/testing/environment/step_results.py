"""Checks that returned values and ends belong to the step, and that parts use their columns of actions and values."""

from __future__ import annotations

from contextlib import closing
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core.util.arrays import Floats
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import difference, expect_close
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.under_test import EnvUnderTest, inside, is_ours

_LONGEST = 1_000
_FOREIGN = ("is_success", "episode", "final_obs", "final_info", "TimeLimit.truncated", "time_limit_reached")


def step_shows_its_action(subject: EnvUnderTest) -> None:
    """Opposite actions in the same state result in different observations and rewards in that step."""
    subject.require_pause()
    with subject.ours() as env:
        if inside(env).randomization is not None:
            raise NotApplicable("randomized values may be delayed")
        space = env.action_space
        if isinstance(space, gym.spaces.Box):
            first, second = space.low.copy(), space.high.copy()
        else:
            drawn = draw_actions(space, 30, seed=0)
            first, second = drawn[0], next((one for one in drawn if not np.array_equal(one, drawn[0])), drawn[0])
        same_reward, same_observation, rewards = 0, 0, set()
        for seed in range(6):
            steps = []
            for action in (first, second):
                env.reset(seed=seed)
                # both episodes begin with the same actions, so a result delayed by one step would be the same in both
                for before in draw_actions(space, 2, seed):
                    env.step(before)
                steps.append(deepcopy(env.step(action)[:2]))
                rewards |= {steps[-1][1], float(env.step(action)[1])}
            same_observation += difference(steps[0][0], steps[1][0]) is None
            same_reward += steps[0][1] == steps[1][1]
    if same_observation == 6 and isinstance(space, gym.spaces.Discrete) and space.n == 1:
        raise Inconclusive("there is only one action")
    expect(
        same_observation < 6,
        "the observation of a step does not depend on its action; check whether the observation is delayed by one "
        "step.",
    )
    if len(rewards) <= 2:
        raise NotApplicable(f"the rewards have only {len(rewards)} different values, too few to detect a delay")
    expect(
        same_reward < 6,
        "the reward of a step does not depend on its action; check whether the reward is delayed by one step.",
    )


def ends_have_their_reason(subject: EnvUnderTest) -> None:
    """Episodes are truncated after exactly ``max_episode_steps``, and terminated whenever the state is terminal."""
    with closing(subject.make()) as env:
        limit = env.spec.max_episode_steps if env.spec else None
        if not limit or limit > _LONGEST:
            raise NotApplicable(f"the time limit is {limit}; only limits up to {_LONGEST} steps are checked")
        ours, reached, ends = is_ours(env), 0, set()
        for seed in range(3):
            env.reset(seed=seed)
            for k, action in enumerate(draw_actions(env.action_space, limit, seed), start=1):
                _, _, terminated, truncated, info = env.step(action)
                if ours:
                    _expect_reason(inside(env), bool(terminated), k, info)
                if ours and truncated and k < limit:
                    expect(
                        "frobs/diverged" in info,
                        f"the episode was truncated after {k} of {limit} steps, although the simulation did not "
                        "diverge.",
                    )
                if k == limit:
                    reached += 1
                    expect(truncated, f"the episode was not truncated after {limit} steps, which is the time limit.")
                if terminated or truncated:
                    ends.add((k, bool(terminated)))
                    break
        last, by_task = next(iter(ends), (0, False))
        expect(
            len(ends) != 1 or not by_task or last < limit - 1,
            f"every episode is terminated at step {last}, near the time limit of {limit} steps; episodes must be "
            "truncated at the time limit instead, so that the final value is bootstrapped.",
        )
    if not ours:
        _expect_reached(reached)
        return
    with closing(subject.make_vec(2, AutoresetMode.DISABLED)) as batch:
        batch.reset(seed=0)
        for action in draw_actions(batch.action_space, limit, seed=0):
            _, _, terminated, truncated, info = batch.step(action)
            if (terminated | truncated).any():
                ends = inside(batch).task.is_terminated()
                expected = np.zeros(2, np.bool_) if ends is None else ends
                expect(
                    "frobs/diverged" in info or (terminated == expected).all(),
                    f"in a batch, terminated is {terminated}, but the task's is_terminated() is {expected}.",
                )
                break
    _expect_reached(reached)


def info_keys_have_their_prefix(subject: EnvUnderTest) -> None:
    """All info keys begin with ``frobs/``, except ``is_success`` and the standard keys of wrappers."""
    with subject.ours() as env:
        infos = [env.reset(seed=0)[1], *(env.step(action)[4] for action in draw_actions(env.action_space, 3, seed=0))]
    for info in infos:
        odd = [key for key in info if not key.startswith("frobs/") and key not in _FOREIGN]
        expect(not odd, f"the info contains the keys {odd}; the keys of FRobs environments must begin with 'frobs/'.")


def _expect_reached(reached: int) -> None:
    if not reached:
        raise Inconclusive("no episode reached the time limit")


def _expect_reason(env: Any, terminated: bool, step: int, info: dict[str, Any]) -> None:
    if "frobs/diverged" in info:
        return
    ends = env.task.is_terminated()
    ended = bool(ends is not None and ends[0])
    expect(ended == terminated, f"step {step}: terminated is {terminated}, but the task's is_terminated() is {ended}.")


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

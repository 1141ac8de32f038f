"""Checks of an environment's life cycle: time, required resets, rejected actions and reset options."""

from __future__ import annotations

from contextlib import closing
from copy import deepcopy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core.util.errors import FrobsError, InvalidActionError, ResetNeededError, UnknownParameterError
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect, expect_raises
from frobs_devkit.testing.compare import difference, expect_close, expect_same, row
from frobs_devkit.testing.environment.rollout import draw_actions
from frobs_devkit.testing.environment.under_test import EnvUnderTest, inside, observes_truly

_LONGEST = 400


def time_advances(subject: EnvUnderTest) -> None:
    """Each step advances the time by exactly ``control_timestep``, and a reset sets the time to 0."""
    subject.require_pause()
    with subject.ours() as env:
        simulation, dt = inside(env).simulation, inside(env).control_timestep
        for seed in (0, 1):
            env.reset(seed=seed)
            expect_close(0.0, simulation.time[0], 0.0, "the time after a reset [s]")
            for k, action in enumerate(draw_actions(env.action_space, 10, seed), start=1):
                _, _, terminated, truncated, _ = env.step(action)
                expect_close(k * dt, simulation.time[0], 1e-9, f"the time after {k} steps of {dt} s [s]")
                if terminated or truncated:
                    break
        fps = env.metadata.get("render_fps")
        expect(
            fps == max(1, round(1 / dt)),
            f"metadata['render_fps'] is {fps}; expected the rounded value of 1 / control_timestep, but at least 1, where "
            f"control_timestep is {dt} s.",
        )


def step_needs_reset(subject: EnvUnderTest) -> None:
    """A step before the first reset or after the end of an episode raises ResetNeededError."""
    with subject.ours() as wrapped:
        env = wrapped.unwrapped
        actions = draw_actions(env.action_space, _LONGEST, seed=4)
        _expect_raises(ResetNeededError, env, actions[0], "a step before the first reset")
        env.reset(seed=4)
        for action in actions:
            if env.step(action)[2]:
                _expect_raises(ResetNeededError, env, action, "a step after termination")
                break
    with closing(subject.make_vec(2, AutoresetMode.DISABLED)) as batch:
        actions = draw_actions(batch.action_space, _LONGEST, seed=4)
        _expect_raises(ResetNeededError, batch, actions[0], "a step of a batch before the first reset")
        batch.reset(seed=4)
        for action in actions:
            _, _, terminated, truncated, _ = batch.step(action)
            if (terminated | truncated).any():
                _expect_raises(ResetNeededError, batch, action, "a step of a batch after the end of an episode")
                return
    raise Inconclusive(f"no episode ended in {_LONGEST} steps")


def bad_actions_refused(subject: EnvUnderTest) -> None:
    """An action that has the wrong shape, is not finite or is outside a discrete space raises InvalidActionError.

    A rejected action does not affect later observations.
    """
    subject.require_pause()
    with subject.ours() as wrapped:
        env = wrapped.unwrapped
        good = draw_actions(env.action_space, 6, seed=2)
        bad = _bad_actions(env.action_space)
        first = env.reset(seed=2)[0]
        expected = [env.step(action)[0] for action in good]
        expect_same(first, env.reset(seed=2)[0], "the first observation")
        for k, action in enumerate(good):
            for what, wrong in bad.items():
                _expect_raises(InvalidActionError, env, wrong, what)
            expect_same(expected[k], env.step(action)[0], f"step {k + 1} after rejected actions")
    with closing(subject.make_vec(3, AutoresetMode.SAME_STEP)) as batch:
        batch.reset(seed=2)
        actions = draw_actions(batch.action_space, 1, seed=2)[0]
        _expect_raises(InvalidActionError, batch, actions[:2], "a batch of 2 actions for 3 environments")
        if np.asarray(actions).dtype.kind == "f":
            actions[1] = np.nan
            _expect_raises(InvalidActionError, batch, actions, "a batch in which one action contains NaN")


def reset_options_hold(subject: EnvUnderTest) -> None:
    """A reset applies the options that the task declares and rejects unknown options."""
    with subject.ours() as env:
        with expect_raises(UnknownParameterError, "reset(options={'no_such_option': …})"):
            env.reset(seed=0, options={"no_such_option": 1.0})
        seen = False
        understood = inside(env).task.reset_options
        if "joint_positions" in understood:
            requested = _some_joint_positions(inside(env).robot)
            env.reset(seed=0, options={"joint_positions": requested})
            actual = inside(env).robot.joint_positions[0]
            expect_close(requested, actual, 1e-6, "joint positions after reset(options={'joint_positions': …})")
            seen = True
        for name in set(understood) - {"joint_positions"}:
            changes = _changes_the_beginning(env, name)
            seen |= changes is not None
            expect(
                changes is not False,
                f"reset(options={{'{name}': …}}) has no effect, but the task declares the option '{name}'.",
            )
        goals = [_goal(env.reset(seed=seed)[0]) for seed in (0, 1)]
        if "goal" in understood and goals[0] is not None and observes_truly(env, "desired_goal"):
            actual = _goal(env.reset(seed=0, options={"goal": goals[1]})[0])
            expect_close(goals[1], actual, 1e-6, "desired_goal after reset(options={'goal': …})")
            seen = True
    if not seen:
        raise NotApplicable("the task has no reset option that this check can test")


def options_hold_by_row(subject: EnvUnderTest) -> None:
    """If only some environments of a batch are reset, each of these environments uses its own row of a reset option."""
    subject.require_pause()
    with subject.ours() as single:
        tried = {name: _two_values(single, name) for name in inside(single).task.reset_options}
        given = {name: values for name, values in tried.items() if values is not None}
        if not given:
            raise Inconclusive(
                "the check found no reset option with two accepted values that give different initial states"
            )
        with closing(subject.make_vec(3, AutoresetMode.DISABLED)) as batch:
            for name, (one, other) in given.items():
                batch.reset(seed=0)
                mask = np.array([False, True, False])
                actual = batch.reset(options={name: np.stack([one, other, one]), "reset_mask": mask})[0]
                single.reset(seed=1)
                expected = single.reset(options={name: other})[0]
                what = f"environment 1 of a batch of 3, reset alone with options={{'{name}': …}}"
                expect_same(
                    expected, row(actual, 1), f"{what}, compared with one environment reset with row 1 of the option"
                )


def _two_values(env: Any, name: str) -> tuple[Any, Any] | None:
    """Return two accepted values of an option that give different initial states, or None if none are found."""
    accepted: list[tuple[Any, Any]] = []
    for seed in (1, 2):
        joints = _some_joint_positions(inside(env).robot) + (0.01 * seed if name == "joint_positions" else 0.0)
        for value in (*_reset_values(env, seed), joints):
            begun = _begin(env, 0, {name: value})
            if begun is None:
                continue
            seen = begun["observation"]
            if all(np.shape(value) == np.shape(one) and difference(seen, other) for one, other in accepted):
                accepted.append((value, seen))
            if len(accepted) == 2:
                return accepted[0][0], accepted[1][0]
    return None


def _changes_the_beginning(env: Any, name: str) -> bool | None:
    """Return whether an option changes the initial state of an episode, or None if no tested value is accepted."""
    values = (*_reset_values(env, 1), np.full(2, 0.3), _some_joint_positions(inside(env).robot), 0.3)
    plain = _begin(env, 0)
    accepted = (begun for value in values if (begun := _begin(env, 0, {name: value})) is not None)
    begun = next(accepted, None)
    return None if begun is None else difference(plain, begun) is not None


def _reset_values(env: Any, seed: int) -> list[Any]:
    """Return values that a reset option may accept: the goal and the markers of an episode, and a tool position."""
    goal, tool = _goal(env.reset(seed=seed)[0]), inside(env).robot.frame_pose("tcp")[0][0] + 0.01
    marks = [mark.pos[0] for mark in inside(env).task.markers()]
    return deepcopy([*([] if goal is None else [goal]), *marks, tool])


def _begin(env: Any, seed: int, options: dict[str, Any] | None = None) -> dict[str, Any] | None:
    """Begin an episode, and return its initial state, or None if the environment rejects the options."""
    robot, task = inside(env).robot, inside(env).task
    try:
        observation, _ = env.reset(seed=seed, options=options)
    except (FrobsError, ValueError):  # a value has the wrong shape or is out of reach
        return None
    marks = [mark.pos for mark in task.markers()]
    state = {"observation": observation, "marks": marks, "robot": robot.joint_positions, "base": robot.base_pose}
    return deepcopy(state)


def _goal(observation: Any) -> Any:
    return deepcopy(observation.get("desired_goal")) if isinstance(observation, dict) else None


def _some_joint_positions(robot: Any) -> Any:
    """Return joint positions near the home position and within the joint limits, (dof,)."""
    off_home = robot.home[0] + 0.05 * np.where(np.arange(robot.dof) % 2, 1.0, -1.0)
    return np.clip(off_home, robot.position_lower[0], robot.position_upper[0])


def _bad_actions(space: gym.Space[Any]) -> dict[str, Any]:
    if isinstance(space, gym.spaces.Discrete):
        return {
            "an action above the range of the discrete space": int(space.start + space.n),
            "an action below the range of the discrete space": int(space.start - 1),
        }
    assert space.shape is not None
    bad: dict[str, Any] = {
        "an action with an extra dimension": np.zeros((*space.shape, 1), space.dtype),
        "an action with an extra element": np.zeros((space.shape[0] + 1, *space.shape[1:]), space.dtype),
    }
    if isinstance(space, gym.spaces.Box):
        for name, value in (("NaN", np.nan), ("infinity", np.inf)):
            action = np.zeros(space.shape, space.dtype)
            action[-1] = value
            bad[f"an action with {name}"] = action
    return bad


def _expect_raises(expected: type[FrobsError], env: Any, action: Any, what: str) -> None:
    with expect_raises(expected, what):
        env.step(action)

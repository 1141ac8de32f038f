"""Faults in a task: reach with one thing broken."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.description import Contact
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.testing import CheckFailure, check_env, check_task, run_checks
from frobs_devkit.testing.environment import vector
from frobs_tasks_reach.reach import Reach

FAULTS: list[Any] = []


def wrong(name: str, check: str) -> Callable[[Callable[..., Any]], None]:
    def note(faulty: Callable[..., Any]) -> None:
        FAULTS.append(pytest.param(name, check, faulty, id=faulty.__name__))

    return note


@wrong("__init__", "record_is_sound")
def positional_keyword(original: Any, self: Any, goal_tolerance: float = 0.05) -> None:
    original(self)


@wrong("reward", "reward_types_work")
def sparse_is_dense(original: Any, self: Any, context: Any) -> Any:
    return original(self, context) + 1e-3 * self._robot.joint_positions[:, 0]


@wrong("reward", "batch_has_its_shapes")
def reward_in_float32(original: Any, self: Any, context: Any) -> Any:
    return original(self, context).astype(np.float32)


def squared_change(context: Any, previous: Any) -> Any:
    return ((context.raw_action - previous) ** 2).sum(axis=1)


@wrong("reward", "reading_changes_nothing")
def reward_keeps_the_action_itself(original: Any, self: Any, context: Any) -> Any:
    previous = getattr(self, "_previous", 0.0)
    self._previous = context.raw_action.copy()
    return original(self, context) - squared_change(context, previous)


@wrong("advance", "snapshot_continues")
def action_missing_from_the_snapshot(original: Any, self: Any, context: Any) -> None:
    original(self, context)
    self._change = squared_change(context, getattr(self, "_previous", np.zeros(6)))
    self._previous = context.raw_action.copy()
    self.distance = self.distance + 1e-3 * self._change


@wrong("reward", "reading_changes_nothing")
def reward_writes_to_the_context(original: Any, self: Any, context: Any) -> Any:
    reward = original(self, context) - squared_change(context, context.previous_raw_action)
    context.raw_action *= 0.5
    return reward


@wrong("reward", "same_step_equals_single")
def commands_of_all_environments(original: Any, self: Any, context: Any) -> Any:
    return original(self, context) - np.abs(context.commands["robot"]).mean()


@wrong("is_success", "batch_has_its_shapes")
def success_as_a_number(original: Any, self: Any) -> Any:
    return original(self).astype(np.float64)


@wrong("observation_terms", "same_step_equals_single")
def centred_over_the_batch(original: Any, self: Any) -> Any:
    terms = dict(original(self))
    joints = terms["joint_positions"].read
    terms["joint_positions"] = replace(terms["joint_positions"], read=lambda: joints() + 1e-5 * joints().mean(0))
    return terms


@wrong("reset", "same_step_equals_single")
def goal_of_its_own_generator(original: Any, self: Any, mask: Any, rng: Any, options: Any) -> None:
    n = len(rng._seeds)
    original(self, mask, rng, {**options, "joint_positions": np.random.default_rng(n).uniform(-0.1, 0.1, (n, 6))})


@wrong("is_success", "success_comes_and_goes")
def success_always(original: Any, self: Any) -> Any:
    return np.ones_like(original(self))


def success_before(task: Any, original: Any, context: Any) -> None:
    before = Reach.is_success(task)
    original(task, context)
    task.is_success = lambda: before


@wrong("advance", "success_belongs_to_its_step")
def success_one_step_late(original: Any, self: Any, context: Any) -> None:
    success_before(self, original, context)


@wrong("advance", "success_belongs_to_its_step")
def success_after_the_end(original: Any, self: Any, context: Any) -> None:
    success_before(self, original, context)
    self.is_terminated = lambda: Reach.is_success(self)


@wrong("reward", "success_belongs_to_its_step")
def sparse_reward_for_failure(original: Any, self: Any, context: Any) -> Any:
    reward = original(self, context)
    return -1.0 - reward if self.reward_type == "sparse" else reward


@wrong("is_terminated", "ends_have_their_reason")
def terminated_by_the_clock(original: Any, self: Any) -> Any:
    return self._simulation.time >= 99.5 * 0.04


@wrong("reset", "reset_options_hold")
def goal_ignored(original: Any, self: Any, mask: Any, rng: Any, options: Any) -> None:
    original(self, mask, rng, {name: value for name, value in options.items() if name != "goal"})


@wrong("reset", "options_hold_by_row")
def options_of_the_first_rows(original: Any, self: Any, mask: Any, rng: Any, options: Any) -> None:
    if mask is not None:
        order = np.argsort(np.argsort(~mask, kind="stable"), kind="stable")  # the row that each environment takes
        options = {name: values[order] for name, values in options.items()}
    original(self, mask, rng, options)


@wrong("reward", "approaching_pays")
def reward_for_leaving(original: Any, self: Any, context: Any) -> Any:
    return -original(self, context)


@wrong("scene", "record_is_sound")
def contacts_undeclared(original: Any, self: Any) -> Any:
    return replace(original(self), contacts={"floor": Contact(first="robot", second="floor")})


def plant(monkeypatch: pytest.MonkeyPatch, name: str, faulty: Callable[..., Any]) -> None:
    original = getattr(Reach, name)

    def replaced(self: Any, *args: Any, **kwargs: Any) -> Any:
        return faulty(original, self, *args, **kwargs)

    if faulty.__name__ == "positional_keyword":
        replaced = lambda self, goal_tolerance=0.05: original(self)  # noqa: E731 - its signature is the fault
    monkeypatch.setattr(Reach, name, replaced)


def sparse_is_the_distance(original: Any, self: Any, context: Any) -> Any:
    reward = original(self, context)
    if self.reward_type != "sparse":
        return reward
    self._reward_terms = {"outside": -self.distance}
    return -self.distance


def marks_of_one(original: Any, self: Any) -> Any:
    return [replace(mark, pos=mark.pos[0]) for mark in original(self)]


def a_term_without_a_unit(original: Any, self: Any) -> Any:
    terms = dict(original(self))
    return {**terms, "goal": replace(terms["goal"], unit="")}


def looking_moves_the_goal(original: Any, self: Any) -> Any:
    self._goal += 1e-6
    return original(self)


def a_term_of_the_default_timestep(original: Any, self: Any) -> Any:
    terms = dict(original(self))
    joints = terms["joint_positions"].read
    return {
        **terms,
        "joint_positions": replace(terms["joint_positions"], read=lambda: joints() + 1e-3 * self.control_timestep),
    }


OWN: dict[str, tuple[str, Callable[..., Any]]] = {
    "record_is_sound": ("__init__", lambda original, self, **keywords: original(self, **keywords)),
    "reward_types_work": ("reward", sparse_is_the_distance),
    "reset_needs_are_stated": ("reset_needs", lambda original, self, options=(): {}),
    "batch_has_its_shapes": ("markers", marks_of_one),
    "observation_terms_are_sound": ("observation_terms", a_term_without_a_unit),
    "reading_changes_nothing": ("markers", looking_moves_the_goal),
    "default_timestep_is_a_default": ("observation_terms", a_term_of_the_default_timestep),
}
"""The checks of a task that are not an environment's, each with a fault that it alone catches."""


@pytest.mark.slow
@pytest.mark.parametrize("check", OWN)
def test_no_other_check_catches(monkeypatch: pytest.MonkeyPatch, check: str) -> None:
    monkeypatch.setattr(vector, "STEPS", 20)
    name, faulty = OWN[check]
    signature = inspect.signature(Reach.__init__)
    plant(monkeypatch, name, faulty)
    if name == "__init__":  # all else is sound, but for a parameter that is not keyword-only
        own, *keywords = signature.parameters.values()
        positional = inspect.Parameter("x", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=0)
        planted: Any = Reach.__init__
        planted.__signature__ = signature.replace(parameters=[own, positional, *keywords])
    assert [result.name for result in run_checks(check_task("reach")).failed] == [check]


@pytest.mark.parametrize(("name", "check", "faulty"), FAULTS)
def test_the_kit_catches(monkeypatch: pytest.MonkeyPatch, name: str, check: str, faulty: Callable[..., Any]) -> None:
    monkeypatch.setattr(vector, "STEPS", 12)  # the fault shows at once
    plant(monkeypatch, name, faulty)
    with pytest.raises(CheckFailure):
        next(c for c in check_task("reach") if c.name == check).run()


def test_the_checks_of_the_environment_are_among_those_of_the_task() -> None:
    of_environment = {check.name for check in check_env("frobs/Irb120Reach-v0")}
    own = [check.name for check in check_task("reach") if check.name not in of_environment]
    assert own == list(OWN)


def test_a_task_without_an_id_needs_a_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    record = replace(plugins.get_record("task", "reach"), environments=())
    monkeypatch.setattr(plugins, "get_record", lambda kind, name: record)
    with pytest.raises(ConfigurationError, match="check_task needs robot="):
        check_task("reach")
    assert check_task("reach", robot="irb120", controller="joint_position")

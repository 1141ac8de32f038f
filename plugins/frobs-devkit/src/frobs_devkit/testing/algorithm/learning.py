"""Checks of an algorithm's learning, stopping, predictions, reproducibility and settings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Algorithm
from frobs_core.util.errors import FrobsError, UnknownParameterError
from frobs_core.util.plain import is_plain
from frobs_devkit.testing.algorithm.under_test import DISCOUNT, AlgorithmUnderTest, Monitor
from frobs_devkit.testing.checks import Inconclusive, after, expect, expect_raises
from frobs_devkit.testing.compare import expect_same

_RESOURCES = {"threads", "workers", "runners", "cpus", "gpus", "processes"}  # words of settings of speed only
_FARTHEST = 10.0  # largest absolute observation to test, even if the space allows larger values


class _Impatient(Monitor):
    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        super().on_progress(steps, metrics)
        return False


class _Curious(Monitor):
    """A monitor that requests predictions before training and at each progress report, in both modes."""

    algorithm: Algorithm
    seen: Any

    def predict(self) -> None:
        for deterministic in (True, False):
            self.algorithm.predict(self.seen, deterministic=deterministic)

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        self.predict()
        return super().on_progress(steps, metrics)


def spaces_are_kept(subject: AlgorithmUnderTest) -> None:
    """The algorithm's spaces equal the spaces of a single environment, not the batched spaces."""
    with closing(subject.make_env()) as env:
        for name, expected in (("observation", env.single_observation_space), ("action", env.single_action_space)):
            actual = getattr(subject.untrained, f"{name}_space")
            expect(actual == expected, f"{name}_space is {actual}, not {expected}.")


def learns(subject: AlgorithmUnderTest) -> None:
    """Training runs for the requested number of steps, reports increasing step counts, and changes the policy."""
    monitor = subject.trained[1]
    expect(monitor.steps, "on_progress was never called.")
    expect(monitor.steps == sorted(monitor.steps), f"the reported steps decrease: {monitor.steps}.")
    expect(monitor.steps[-1] >= subject.steps, f"it trained for {monitor.steps[-1]} of {subject.steps} steps.")
    expect(
        monitor.offers or len(monitor.steps) < 3,
        "the algorithm never calls offer_checkpoint, so its training runs cannot be resumed.",
    )
    subject.require_learning()


def steps_count_every_environment(subject: AlgorithmUnderTest) -> None:
    """Reported step counts include the steps of all environments, and all training actions are in the action space."""
    monitor = subject.trained[1]
    env = monitor.env
    expect(
        monitor.steps == monitor.taken,
        f"the algorithm reports the step counts {monitor.steps[:5]}, but its {env.num_envs} environments took "
        f"{monitor.taken[:5]} steps.",
    )
    expect(env.outside is None, f"training uses an action outside the action space {env.action_space}: {env.outside}.")


def stops_when_told(subject: AlgorithmUnderTest) -> None:
    """Training stops as soon as ``on_progress`` returns False, without further steps or reports."""
    monitor = subject.train(subject.enough, monitor=_Impatient)[1]
    if not monitor.steps:
        raise Inconclusive("on_progress was never called")
    expect(
        len(monitor.steps) == 1 and monitor.env.taken == monitor.taken[0],
        f"on_progress returned False at {monitor.steps[0]} steps, but training continued to "
        f"{max(monitor.steps[-1], monitor.env.taken)} steps.",
    )


def predicts_in_the_space(subject: AlgorithmUnderTest) -> None:
    """Predictions are in the action space, and deterministic predictions are repeatable.

    The deterministic prediction for one row of a batch does not depend on the other rows. A row whose episode starts
    does not depend on the given state of a recurrent policy.
    """
    extreme = _extreme_observations(subject.untrained.observation_space)
    for algorithm in (subject.untrained, subject.trained[0]):
        seen = subject.observations(5)
        actions, space = algorithm.predict(seen)[0], algorithm.action_space
        expect(len(actions) == 5, f"there are {len(actions)} actions for 5 observations.")
        sampled = algorithm.predict(seen, deterministic=False)[0]
        for action in (*actions, *sampled, *(() if extreme is None else algorithm.predict(extreme)[0])):
            typed = np.asarray(action).astype(space.dtype)
            expect(space.contains(typed), f"action {action!r} is not in {space}.")
        expect_same(actions, algorithm.predict(seen)[0], "a repeated deterministic prediction")
        alone = algorithm.predict(seen[2:3])[0]
        expect(np.allclose(actions[2:3], alone, atol=1e-5), "row 2 alone gives a different action.")
        state = algorithm.predict(seen[::-1])[1]
        if state is not None:
            again = algorithm.predict(seen, state, np.ones(5, np.bool_))[0]
            expect_same(actions, again, "predictions for episodes that start, with the state of other episodes")


def same_seed_repeats(subject: AlgorithmUnderTest) -> None:
    """Training gives the same result with the same seed and a different result with another seed."""
    subject.require_reproducible()
    again, other = (subject.train(subject.steps, seed) for seed in (5, 6))
    text = subject.different(subject.trained, again)
    expect(text is None, f"training again with the same seed gives another result: {text}.")
    expect(
        subject.different(subject.trained, other),
        "training runs with two different seeds give bit-identical results; the seed has no effect.",
    )


def training_ends_at_its_steps(subject: AlgorithmUnderTest) -> None:
    """Training ends in the iteration that reaches the requested steps, and then has nothing more to do."""
    with closing(subject.make_env()) as env:
        algorithm, monitor = subject.make(env), Monitor(env)
        algorithm.train(subject.steps, monitor)
        taken = env.taken
        longest = max(b - a for a, b in pairwise([0, *monitor.steps, taken]))
        expect(
            taken < subject.steps + longest,
            f"train({subject.steps}) takes {taken} steps, although its iterations have at most {longest} steps.",
        )
        algorithm.train(subject.steps, monitor)
    expect(
        env.taken == taken,
        f"a second train({subject.steps}) takes {env.taken - taken} more steps; the number includes all earlier steps.",
    )


def resets_without_a_seed(subject: AlgorithmUnderTest) -> None:
    """Training resets the environment without a seed, because a fixed seed would repeat the same episodes."""
    seeds = subject.trained[1].env.seeds
    expect(not seeds, f"training resets its environment with the seed {seeds[:1]}; call reset() without one.")


@after("same_seed_repeats")
def predicting_changes_nothing(subject: AlgorithmUnderTest) -> None:
    """Predictions during training do not affect the weights or the random number generators."""
    subject.require_reproducible()
    expected, total = subject.trained, subject.steps
    if len(expected[1].steps) < 2:  # with only one report, no training would follow the predictions
        total = subject.enough
        expected = subject.train(total)
    with closing(subject.make_env()) as env:
        algorithm, monitor = subject.make(env), _Curious(env)
        monitor.algorithm, monitor.seen = algorithm, subject.observations(8)
        monitor.predict()
        algorithm.train(total, monitor)
    text = subject.different(expected, (algorithm, monitor))
    expect(text is None, f"after a training run with additional predictions, {text}.")


@after("same_seed_repeats")
def settings_count(subject: AlgorithmUnderTest) -> None:
    """Every numeric setting affects training, unless it belongs to a feature that is switched off."""
    subject.require_reproducible()
    subject.require_learning()
    # an interval that is longer than the training run would hide other settings, such as those of a target network
    often = {
        name: max(1, subject.steps // 4)
        for name, value in subject.settings.items()
        if "interval" in name and isinstance(value, int) and value > subject.steps
    }
    if often:
        subject = replace(subject, config={**subject.config, **often})
    resolved = subject.settings
    off = {word for name, value in resolved.items() if not value for word in _words(name)}
    silent = [
        name
        for name, value in resolved.items()
        if isinstance(value, int | float) and value > 0 and not isinstance(value, bool)
        if name != DISCOUNT and not _words(name) & (off | _RESOURCES) and _changes_nothing(subject, name, value)
    ]
    if silent:  # settings may have no effect in the first iteration, or in the second half of a training run
        longer = replace(subject, steps=subject.enough)
        silent = [name for name in silent if _changes_nothing(longer, name, resolved[name])]
    expect(
        not silent,
        f"training gives bit-identical results with other values of {', '.join(silent)}; check whether the algorithm "
        "uses these settings.",
    )


def _words(name: str) -> set[str]:
    return {word for word in name.split("_") if len(word) > 1}


def _changes_nothing(subject: AlgorithmUnderTest, name: str, value: float) -> bool:
    """Return whether several values of a setting give the same training run. False if no other value is accepted."""
    others = [0.5 * value, 2.0 * value, 0.01 * value]
    if isinstance(value, int):
        # A size that is larger than the training run could not have an effect. An interval of 1 may count steps of
        # a loop that takes a single step.
        others = [subject.steps // 4] if value > subject.steps else [max(1, value // 2), 2 * value]
    accepted = False
    for other in others:
        if other == value or (value == 1 and "interval" in name):
            continue
        changed = replace(subject, config={**subject.config, name: type(value)(other)})
        try:
            run = changed.trained
        except FrobsError:  # out of range, or in conflict with another setting
            continue
        accepted = True
        if subject.different(subject.trained, run):
            return False
    return accepted


def unknown_settings_refused(subject: AlgorithmUnderTest) -> None:
    """An unknown setting raises an error that contains the setting's name."""
    with expect_raises(UnknownParameterError, "a setting 'no_such_setting'", naming="no_such_setting"):
        subject.record.load().resolve_config({**subject.config, "no_such_setting": 1})


def settings_resolve_once(subject: AlgorithmUnderTest) -> None:
    """Resolved settings are plain YAML values, and resolving them again does not change them."""
    resolved = subject.settings
    expect(replace(subject, config=resolved).settings == resolved, "resolving resolved settings changes them.")
    odd = [f"{key}: {value!r}" for key, value in resolved.items() if not is_plain(value)]
    expect(not odd, f"YAML cannot represent {', '.join(odd)}.")


def _extreme_observations(space: gym.Space[Any]) -> Any:
    """Return four corners of a flat observation space as an array (4, k), or None for other spaces.

    The corners are far from the observations that occur during training.
    """
    if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
        return None
    low, high = np.maximum(space.low, -_FARTHEST), np.minimum(space.high, _FARTHEST)
    odd = np.arange(low.size) % 2 == 0
    return np.stack([low, high, np.where(odd, low, high), np.where(odd, high, low)]).astype(space.dtype)

"""Checks of an algorithm's learning, stopping, predictions, reproducibility and settings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.errors import UnknownParameterError
from frobs_core.interfaces import Algorithm
from frobs_core.plain import is_plain
from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest, Monitor
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect, expect_raises
from frobs_devkit.testing.compare import difference, expect_same

_FARTHEST = 10.0  # largest absolute observation to test, even if the space allows larger values


class _Impatient(Monitor):
    """A monitor that stops training after the first progress report."""

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Store the report and stop training."""
        super().on_progress(steps, metrics)
        return False


class _Curious(Monitor):
    """A monitor that requests deterministic and stochastic predictions at each progress report."""

    algorithm: Algorithm
    seen: Any

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Request predictions and continue training."""
        for deterministic in (True, False):
            self.algorithm.predict(self.seen, deterministic=deterministic)
        return super().on_progress(steps, metrics)


def spaces_are_kept(subject: AlgorithmUnderTest) -> None:
    """The algorithm's spaces equal the spaces of a single environment, not the batched spaces."""
    with closing(subject.make_env()) as env:
        for name, wanted in (("observation", env.single_observation_space), ("action", env.single_action_space)):
            found = getattr(subject.untrained, f"{name}_space")
            expect(found == wanted, f"{name}_space is {found}, not {wanted}.")


def learns(subject: AlgorithmUnderTest) -> None:
    """Training runs for the requested number of steps, reports increasing step counts, and changes the policy."""
    seen = subject.observations(8)
    algorithm, monitor = subject.trained
    expect(monitor.steps, "on_progress was never called.")
    expect(monitor.steps == sorted(monitor.steps), f"the reported steps decrease: {monitor.steps}.")
    expect(monitor.steps[-1] >= subject.steps, f"it trained for {monitor.steps[-1]} of {subject.steps} steps.")
    expect(
        monitor.offers or len(monitor.steps) < 3,
        "the algorithm never calls offer_checkpoint, so its training runs cannot be resumed.",
    )
    if difference(subject.untrained.predict(seen)[0], algorithm.predict(seen)[0]) is None:
        raise Inconclusive(f"{subject.steps} steps changed no prediction")


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

    The deterministic prediction for one row of a batch does not depend on the other rows.
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


def same_seed_repeats(subject: AlgorithmUnderTest) -> None:
    """Training gives the same result with the same seed and a different result with another seed."""
    if not subject.record.reproducible:
        raise NotApplicable("the algorithm's record declares reproducible=False")
    seen = subject.observations(8)
    expected, again, other = (
        algorithm.predict(seen)[0]
        for algorithm, _ in (subject.trained, *(subject.train(subject.steps, s) for s in (5, 6)))
    )
    expect_same(expected, again, "predictions after training again with the same seed")
    if expected.dtype.kind == "f":
        expect(
            difference(expected, other),
            "training runs with two different seeds give bit-identical results; the seed has no effect.",
        )


def resets_without_a_seed(subject: AlgorithmUnderTest) -> None:
    """Training resets the environment without a seed, because a fixed seed would repeat the same episodes."""
    seeds = subject.trained[1].env.seeds
    expect(not seeds, f"training resets its environment with the seed {seeds[:1]}; call reset() without one.")


@after("same_seed_repeats")
def predicting_changes_nothing(subject: AlgorithmUnderTest) -> None:
    """Predictions during training do not affect the weights or the random number generators."""
    if not subject.record.reproducible:
        raise NotApplicable("the algorithm's record declares reproducible=False")
    seen, (trained, told) = subject.observations(8), subject.trained
    total = subject.steps
    if len(told.steps) < 2:  # with only one report, no training would follow the predictions
        total = subject.enough
        trained = subject.train(total)[0]
    with closing(subject.make_env()) as env:
        algorithm, monitor = subject.make(env), _Curious(env)
        monitor.algorithm, monitor.seen = algorithm, seen
        algorithm.train(total, monitor)
    expected = trained.predict(seen)[0]
    expect_same(expected, algorithm.predict(seen)[0], "predictions after a training run with additional predictions")


def unknown_settings_refused(subject: AlgorithmUnderTest) -> None:
    """An unknown setting raises an error that contains the setting's name."""
    with expect_raises(UnknownParameterError, "a setting 'no_such_setting'", naming="no_such_setting"):
        subject.record.load().resolve_config({**subject.config, "no_such_setting": 1})


def settings_resolve_once(subject: AlgorithmUnderTest) -> None:
    """Resolved settings are plain YAML values, and resolving them again does not change them."""
    cls: type[Algorithm] = subject.record.load()
    resolved = cls.resolve_config(subject.config)
    expect(cls.resolve_config(resolved) == resolved, "resolving resolved settings changes them.")
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

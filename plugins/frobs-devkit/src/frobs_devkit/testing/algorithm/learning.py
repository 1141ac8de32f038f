"""Checks that an algorithm learns, stops, predicts, repeats, and knows its settings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing

import numpy as np

from frobs_core.errors import UnknownParameterError
from frobs_core.interfaces import Algorithm
from frobs_core.plain import is_plain
from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest, Monitor
from frobs_devkit.testing.checks import Inconclusive, expect, expect_raises
from frobs_devkit.testing.compare import difference, expect_same


class _Impatient(Monitor):
    """Wants no more after the first word of progress."""

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Keep the steps, and stop."""
        super().on_progress(steps, metrics)
        return False


def spaces_are_kept(subject: AlgorithmUnderTest) -> None:
    """Its spaces are those of one environment, not of the batch."""
    with closing(subject.make_env()) as env, subject.trained(steps=0) as (algorithm, _):
        for name, wanted in (("observation", env.single_observation_space), ("action", env.single_action_space)):
            found = getattr(algorithm, f"{name}_space")
            expect(found == wanted, f"{name}_space is {found}, not {wanted}.")


def stops_when_told(subject: AlgorithmUnderTest) -> None:
    """Training ends when ``on_progress`` returns False, without another word of progress."""
    monitor, cls = _Impatient(), subject.record.load()
    with closing(subject.make_env()) as env:
        cls(env, cls.resolve_config(subject.config), 5).train(20 * subject.steps, monitor)
    if not monitor.steps:
        raise Inconclusive("on_progress was never called")
    expect(len(monitor.steps) == 1, f"on_progress returned False at {monitor.steps[0]} steps, and training went on to "
           f"{monitor.steps[-1]}.")  # fmt: skip


def learns(subject: AlgorithmUnderTest) -> None:
    """Training runs to its steps, tells of its progress in growing numbers, and changes the policy."""
    seen = subject.observations(8)
    with subject.trained(steps=0) as (algorithm, _):
        before = algorithm.predict(seen)[0].copy()
    with subject.trained() as (algorithm, monitor):
        expect(monitor.steps, "on_progress was never called.")
        expect(monitor.steps == sorted(monitor.steps), f"on_progress was told of falling steps: {monitor.steps}.")
        expect(monitor.steps[-1] >= subject.steps, f"it trained for {monitor.steps[-1]} of {subject.steps} steps.")
        expect(monitor.offers or len(monitor.steps) < 3, "offer_checkpoint is never called; no run could be resumed.")
        unchanged = difference(before, algorithm.predict(seen)[0]) is None
    if unchanged:
        raise Inconclusive(f"{subject.steps} steps changed no prediction")
    if not monitor.offers:
        raise Inconclusive("the training was too short for a checkpoint; give smaller settings")


def predicts_in_the_space(subject: AlgorithmUnderTest) -> None:
    """Predictions for a batch are a batch of actions in the space; deterministic ones repeat; row i stands alone."""
    with subject.trained(steps=0) as (algorithm, _):
        seen = subject.observations(5)
        actions = algorithm.predict(seen)[0]
        expect(len(actions) == 5, f"5 observations give {len(actions)} actions.")
        for sampled in (actions, algorithm.predict(seen, deterministic=False)[0]):
            for action in sampled:
                typed = np.asarray(action).astype(algorithm.action_space.dtype)
                expect(algorithm.action_space.contains(typed), f"action {action!r} is not in {algorithm.action_space}.")
        expect_same(actions, algorithm.predict(seen)[0], "a deterministic prediction, again")
        expect(np.allclose(actions[2:3], algorithm.predict(seen[2:3])[0], atol=1e-5), "row 2 alone has another action.")


def same_seed_repeats(subject: AlgorithmUnderTest) -> None:
    """The same seed learns the same; another seed learns something else."""
    seen = subject.observations(8)
    predictions = []
    for seed in (5, 5, 6):
        with subject.trained(seed=seed) as (algorithm, _):
            predictions.append(algorithm.predict(seen)[0].copy())
    expect_same(predictions[0], predictions[1], "predictions after training again with the same seed")
    if predictions[0].dtype.kind == "f":
        expect(difference(predictions[0], predictions[2]), "two seeds learn the same to the last bit.")


def unknown_settings_refused(subject: AlgorithmUnderTest) -> None:
    """A setting that it does not know is refused, and named."""
    with expect_raises(UnknownParameterError, "a setting 'no_such_setting'", naming="no_such_setting"):
        subject.record.load().resolve_config({**subject.config, "no_such_setting": 1})


def settings_resolve_once(subject: AlgorithmUnderTest) -> None:
    """Resolved settings are plain values that YAML can hold, and resolving them again changes nothing."""
    cls: type[Algorithm] = subject.record.load()
    resolved = cls.resolve_config(subject.config)
    expect(cls.resolve_config(resolved) == resolved, "resolving resolved settings changes them.")
    odd = [f"{key}: {value!r}" for key, value in resolved.items() if not is_plain(value)]
    expect(not odd, f"YAML cannot hold {', '.join(odd)}.")

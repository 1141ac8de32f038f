"""Checks that an algorithm learns, predicts, repeats, and knows its settings."""

from __future__ import annotations

import numpy as np

from frobs_core.errors import UnknownParameterError
from frobs_core.interfaces import Algorithm
from frobs_core.plain import is_plain
from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest
from frobs_devkit.testing.checks import CheckFailure, Inconclusive, Outcome, expect
from frobs_devkit.testing.compare import difference, expect_same


def learns(subject: AlgorithmUnderTest) -> Outcome:
    """Training runs to its steps, tells of its progress in growing numbers, and changes the policy."""
    seen = subject.observations(8)
    with subject.trained(steps=0) as (algorithm, _):
        before = algorithm.predict(seen)[0].copy()
    with subject.trained() as (algorithm, monitor):
        expect(monitor.steps, "on_progress was never called.")
        expect(monitor.steps == sorted(monitor.steps), f"on_progress was told of falling steps: {monitor.steps}.")
        expect(
            monitor.steps[-1] >= subject.steps, f"training ended after {monitor.steps[-1]} of {subject.steps} steps."
        )
        expect(
            monitor.offers or len(monitor.steps) < 3, "offer_checkpoint is never called; a run could not be resumed."
        )
        unchanged = difference(before, algorithm.predict(seen)[0]) is None
    if unchanged:
        return Inconclusive(f"{subject.steps} steps changed no prediction")
    return (
        None if monitor.offers else Inconclusive("the training was too short for a checkpoint; give smaller settings")
    )


def predicts_in_the_space(subject: AlgorithmUnderTest) -> Outcome:
    """Predictions for a batch are a batch of actions in the space; deterministic ones repeat; row i stands alone."""
    with subject.trained(steps=0) as (algorithm, _):
        seen = subject.observations(5)
        actions = algorithm.predict(seen)[0]
        expect(len(actions) == 5, f"5 observations give {len(actions)} actions.")
        for sampled in (actions, algorithm.predict(seen, deterministic=False)[0]):
            for action in sampled:
                typed = np.asarray(action).astype(algorithm.action_space.dtype)
                expect(
                    algorithm.action_space.contains(typed), f"the action {action!r} is not in {algorithm.action_space}."
                )
        expect_same(actions, algorithm.predict(seen)[0], "a deterministic prediction, again")
        expect(
            np.allclose(actions[2:3], algorithm.predict(seen[2:3])[0], atol=1e-5), "row 2 alone gives another action."
        )
    return None


def same_seed_repeats(subject: AlgorithmUnderTest) -> Outcome:
    """The same seed learns the same; another seed learns something else."""
    seen = subject.observations(8)
    predictions = []
    for seed in (5, 5, 6):
        with subject.trained(seed=seed) as (algorithm, _):
            predictions.append(algorithm.predict(seen)[0].copy())
    expect_same(predictions[0], predictions[1], "predictions after training again with the same seed")
    if predictions[0].dtype.kind == "f":
        expect(difference(predictions[0], predictions[2]), "two seeds learn the same to the last bit.")
    return None


def unknown_settings_refused(subject: AlgorithmUnderTest) -> Outcome:
    """A setting that it does not know is refused, and named."""
    try:
        subject.record.load().resolve_config({**subject.config, "no_such_setting": 1})
    except UnknownParameterError as error:
        expect("no_such_setting" in str(error), f"the message does not name the setting: {error}")
        return None
    raise CheckFailure("a setting 'no_such_setting' passes; it must raise UnknownParameterError.")


def settings_resolve_once(subject: AlgorithmUnderTest) -> Outcome:
    """Resolved settings are plain values that YAML can hold, and resolving them again changes nothing."""
    cls: type[Algorithm] = subject.record.load()
    resolved = cls.resolve_config(subject.config)
    expect(cls.resolve_config(resolved) == resolved, "resolving resolved settings changes them.")
    odd = [f"{key}: {value!r}" for key, value in resolved.items() if not is_plain(value)]
    expect(not odd, f"YAML cannot hold {', '.join(odd)}.")
    return None

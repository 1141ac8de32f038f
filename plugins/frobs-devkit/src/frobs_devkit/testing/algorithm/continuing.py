"""Checks that an algorithm can be continued, and that its policy can be kept alone."""

from __future__ import annotations

import copy
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym

from frobs_core.interfaces import Algorithm
from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest, Monitor
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect
from frobs_devkit.testing.compare import expect_same


class _SavingMonitor(Monitor):
    """Keeps the rows, and from the first checkpoint of the second half on also a copy of the environment."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any], folder: Path, half: int) -> None:
        super().__init__()
        self.rows: dict[int, dict[str, float]] = {}
        self.saved_at: int | None = None
        self.copied: gym.vector.VectorEnv[Any, Any, Any] | None = None
        self._env, self._folder, self._half = env, folder, half

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Keep the row, and go on."""
        self.rows[steps] = dict(metrics)
        return super().on_progress(steps, metrics)

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        """Take the first of the second half."""
        if steps >= self._half and self.saved_at is None:
            save(self._folder, None)
            self.saved_at, self.copied = steps, copy.deepcopy(self._env)


def continues_exactly(subject: AlgorithmUnderTest) -> None:
    """What was saved in the middle of a training and loaded learns on as if it had never been stopped."""
    env = subject.make_env()
    try:
        copy.deepcopy(env).close()
    except Exception as error:
        env.close()
        raise NotApplicable(f"{subject.id} cannot be copied: {type(error).__name__}: {error}") from error
    cls: type[Algorithm] = subject.record.load()
    seen = subject.observations(8)
    with tempfile.TemporaryDirectory() as folder:
        monitor = _SavingMonitor(env, Path(folder), subject.steps // 2)
        whole = cls(env, cls.resolve_config(subject.config), 5)
        whole.train(subject.steps, monitor)
        expected = whole.predict(seen)[0].copy()
        env.close()
        if monitor.copied is None or monitor.saved_at is None:
            raise Inconclusive("no checkpoint is offered in the second half of the training; give smaller settings")
        again = _SavingMonitor(monitor.copied, Path(folder), subject.steps + 1)
        resumed = cls.load(Path(folder), monitor.copied)
        resumed.train(subject.steps, again)
        expect_same(expected, resumed.predict(seen)[0], "predictions of a training that was continued")
        monitor.copied.close()
    rows = {steps: row for steps, row in monitor.rows.items() if steps > monitor.saved_at}
    expect(list(again.rows) == list(rows), f"continued, it tells of steps {list(again.rows)}, not of {list(rows)}.")
    for steps, row in rows.items():
        expect_same(row, again.rows[steps], f"the metrics at step {steps} of a training that was continued")


def policy_alone_predicts(subject: AlgorithmUnderTest) -> None:
    """What ``save_policy`` writes predicts the same once it is loaded without an environment."""
    with tempfile.TemporaryDirectory() as folder, subject.trained() as (algorithm, _):
        algorithm.save_policy(Path(folder))
        seen = subject.observations(8)
        loaded = type(algorithm).load(Path(folder))
        expect_same(algorithm.predict(seen)[0], loaded.predict(seen)[0], "predictions of the policy kept alone")

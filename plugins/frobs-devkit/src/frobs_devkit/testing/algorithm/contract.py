"""Checks of how an algorithm and a run talk to each other."""

from __future__ import annotations

from collections.abc import Mapping

from frobs_devkit.testing.algorithm.subject import AlgorithmUnderTest, Monitor
from frobs_devkit.testing.checks import Inconclusive, Outcome, expect


class _Impatient(Monitor):
    """Wants no more after the first word of progress."""

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        """Keep the steps, and stop."""
        super().on_progress(steps, metrics)
        return False


def spaces_are_kept(subject: AlgorithmUnderTest) -> Outcome:
    """Its spaces are those of one environment, not of the batch."""
    env = subject.make_env()
    try:
        with subject.trained(steps=0) as (algorithm, _):
            for name, wanted in (("observation", env.single_observation_space), ("action", env.single_action_space)):
                found = getattr(algorithm, f"{name}_space")
                expect(found == wanted, f"{name}_space is {found}, not {wanted}.")
    finally:
        env.close()
    return None


def stops_when_told(subject: AlgorithmUnderTest) -> Outcome:
    """Training ends when ``on_progress`` returns False, without another word of progress."""
    monitor, env = _Impatient(), subject.make_env()
    try:
        cls = subject.record.load()
        cls(env, cls.resolve_config(subject.config), 5).train(20 * subject.steps, monitor)
    finally:
        env.close()
    if not monitor.steps:
        return Inconclusive("on_progress was never called")
    expect(len(monitor.steps) == 1, f"on_progress returned False at {monitor.steps[0]} steps, and training went on to "
           f"{monitor.steps[-1]}.")  # fmt: skip
    return None

"""Evaluates a policy on every simulator."""

from __future__ import annotations

from collections.abc import Sequence

from frobs_core.plugins.records import Level
from frobs_devkit.parity.result import Comparison, Measurement, Panel
from frobs_devkit.parity.under_test import Subject, pairs_of
from frobs_train import Evaluation, PolicyRun, Run, evaluate

EPISODES = 200
_TOGETHER = 64  # number of environments stepped as one batch, if all simulators support batches


def policy(subjects: Sequence[Subject], run: Run, episodes: int = EPISODES) -> Measurement:
    """Compare the success rates of an unmodified policy on all simulators, in the same episodes.

    All simulators step the same number of environments as one batch, so that the episodes have the same goals. The
    results of a run are also written to the run's ``evaluations/`` folder.
    """
    batched = all(subject.level("batched") > Level.UNSUPPORTED for subject in subjects)
    together = min(episodes, _TOGETHER) if batched else 1
    results = [evaluate(run, episodes, simulator=subject.simulator, num_envs=together) for subject in subjects]
    first = results[0]
    comparisons: list[Comparison] = []
    for pair, other in zip(pairs_of(subjects), results[1:], strict=True):
        if first.success_rate is None or other.success_rate is None:
            comparisons.append(pair.skip("the environment does not define success"))
        elif not first.success_rate:
            comparisons.append(pair.skip("the policy never succeeds on the reference"))
        else:
            error, where = (
                other.success_rate / first.success_rate - 1.0,
                f"{_percent(other)} instead of {_percent(first)}",
            )
            comparisons.append(pair.judge("success", "success", abs(error), exact=False, where=where))
    bars = {
        subject.label: (100.0 * result.success_rate, *(100.0 * end for end in result.success_interval))
        for subject, result in zip(subjects, results, strict=True)
        if result.success_rate is not None and result.success_interval is not None
    }
    name = f"unmodified policy of the run '{run.path.name}' after {first.steps:,} training steps"
    if isinstance(run, PolicyRun):
        name = f"policy '{run.policy}'"
    return Measurement(
        summary=f"The {name} is evaluated in {episodes} unseen episodes, which are the same on every simulator. "
        "The intervals are Wilson's 95 % intervals.",
        comparisons=tuple(comparisons),
        facts={
            subject.label: f"success {_percent(result)}, reward {result.mean_reward:.4g} per episode"
            for subject, result in zip(subjects, results, strict=True)
        },
        panels=(Panel(title="Success", y_label="%", bars=bars),) if bars else (),  # type: ignore[arg-type]
    )


def _percent(found: Evaluation) -> str:
    if found.success_rate is None or found.success_interval is None:
        return "unknown"
    low, high = found.success_interval
    return f"{100 * found.success_rate:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"

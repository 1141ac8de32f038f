"""The reward and each of its terms, over random actions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.parity.result import Comparison, Line, Measurement, Panel, judge
from frobs_core.parity.rollout import Rollout, common_steps, play
from frobs_core.parity.subject import Subject, follows_exactly
from frobs_core.parity.tolerances import TOLERANCES

EPISODES = 3
_MOST_STEPS = 200  # of an episode


def rewards(subjects: Sequence[Subject], episodes: int = EPISODES, seed: int = 0) -> Measurement:
    """Compare reward and terms in episodes of random actions.

    Args:
        subjects: The simulators, the reference first.
        episodes: Each with its own seed, and so with its own goal.
        seed: Of the first episode, and of the actions.
    """
    reference = subjects[0]
    steps = min(reference.max_episode_steps, _MOST_STEPS)
    with reference.make() as env:
        env.action_space.seed(seed)
        plans = [(seed + k, np.array([env.action_space.sample() for _ in range(steps)])) for k in range(episodes)]
    played = [play(subject, plans) for subject in subjects]
    names = list(played[0][0].rewards)
    comparisons: list[Comparison] = []
    curves = [
        Line(name, np.arange(1.0, len(values) + 1.0), values, j, i)
        for i, rollouts in enumerate(played)
        for j, (name, values) in enumerate(_joined(rollouts).items())
    ]
    errors_over_time = []
    for i, (subject, rollouts) in enumerate(zip(subjects[1:], played[1:], strict=True), 1):
        worst_of_all = np.zeros(0)
        for name in names:
            pairs = list(zip(played[0], rollouts, strict=True))
            errors = np.concatenate([_errors(a, b, name) for a, b in pairs])
            scale = float(np.ptp(np.concatenate([rollout.rewards[name] for rollout in played[0]])))
            comparisons.append(
                judge(
                    "reward", "reward" if name == "reward" else f"term {name}", subject.label, reference.label, errors,
                    exact=follows_exactly(reference, subject), scale=scale,
                    where=f"step {int(np.argmax(np.nan_to_num(errors, nan=np.inf))) + 1} of {len(errors)}",
                )
            )  # fmt: skip
            worst_of_all = np.maximum(worst_of_all, errors) if len(worst_of_all) else errors
        errors_over_time.append(Line(subject.label, np.arange(1.0, len(worst_of_all) + 1.0), worst_of_all, i))
    return Measurement(
        name="rewards",
        title="Rewards",
        summary=f"The reward and its terms in {episodes} episodes of {steps} random actions, each from its own seed.",
        comparisons=tuple(comparisons),
        panels=(
            Panel(title="Reward and terms", x_label="step", y_label="per step", lines=tuple(curves)),
            Panel(
                title="Largest difference of any of them",
                x_label="step",
                y_label="per step",
                lines=tuple(errors_over_time),
                tolerance=TOLERANCES["reward"].exact if follows_exactly(*subjects) else None,
                log=True,
            ),
        ),
    )


def _joined(rollouts: Sequence[Rollout]) -> dict[str, Floats]:
    """Return the rewards of all episodes, one after the other, with a gap between."""
    gap = np.array([np.nan])
    return {
        name: np.concatenate([part for rollout in rollouts for part in (rollout.rewards[name], gap)][:-1])
        for name in rollouts[0].rewards
    }


def _errors(first: Rollout, second: Rollout, name: str) -> Floats:
    """Return the differences of one term, (steps,); an episode that ended elsewhere, or lacks the term, is a NaN more."""
    if name not in second.rewards:
        return np.full(first.steps, np.nan)
    n = common_steps(first, second)
    errors = np.abs(first.rewards[name][:n] - second.rewards[name][:n])
    return errors if first.steps == second.steps else np.append(errors, np.nan)

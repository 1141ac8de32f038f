"""The reward and each of its terms, over random actions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.parity.result import Comparison, Line, Measurement, Panel, judge, skip
from frobs_core.parity.rollout import Rollout, common_steps, play
from frobs_core.parity.subject import Subject, follows_exactly
from frobs_core.parity.tolerances import TOLERANCES

EPISODES = 3
_CANDIDATES = 40  # episodes that are tried on the reference
_MOST_STEPS = 200  # of an episode
_STANDS = 1e-6  # range of a term below which there was nothing to compare


def rewards(subjects: Sequence[Subject], episodes: int = EPISODES, seed: int = 0) -> Measurement:
    """Compare reward and terms in episodes of random actions.

    Many episodes are tried on the reference; those are compared in which the terms move most: a reward for the last
    centimetres says nothing far from the goal.

    Args:
        subjects: The simulators, the reference first.
        episodes: How many are compared; each has its own seed, and so its own goal.
        seed: Of the first episode, and of the actions.
    """
    reference = subjects[0]
    steps = min(reference.max_episode_steps, _MOST_STEPS)
    with reference.make() as env:
        env.action_space.seed(seed)
        plans = [(seed + k, np.array([env.action_space.sample() for _ in range(steps)])) for k in range(_CANDIDATES)]
    chosen = _liveliest(play(reference, plans), episodes)
    plans = [plans[k] for k in chosen]
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
            what = "reward" if name == "reward" else f"term {name}"
            if scale < _STANDS and not (errors > 0.0).any():
                comparisons.append(skip(subject.label, reference.label, "it stood still in these episodes", what))
                continue
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
        summary=f"The reward and its terms in {episodes} episodes of {steps} random actions, each from its own seed: of "
        f"{_CANDIDATES} such episodes on {reference.label}, those in which the terms move most.",
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


def _liveliest(rollouts: Sequence[Rollout], episodes: int) -> list[int]:
    """Return which episodes to take: for each term in turn the one in which it moves most, then the next."""
    orders = [
        np.argsort([-float(np.ptp(rollout.rewards[name])) for rollout in rollouts], kind="stable").tolist()
        for name in reversed(list(rollouts[0].rewards))  # the terms before their sum
    ]
    ranked = dict.fromkeys(k for place in zip(*orders, strict=True) for k in place)
    return sorted(list(ranked)[:episodes])


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

"""Compares the reward and its terms under random actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from frobs_core.arrays import Floats
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, judge, skip
from frobs_devkit.parity.rollout import AFTER_A_TOUCH, Rollout, free_steps, play
from frobs_devkit.parity.subject import Subject, follows_exactly
from frobs_devkit.parity.tolerances import TOLERANCES

EPISODES = 3
_CANDIDATES = 40  # number of episodes to try on the reference
_MOST_STEPS = 200  # maximum number of steps in an episode
_STANDS = 1e-6  # if the range of a term is smaller, there is nothing to compare


def rewards(subjects: Sequence[Subject], episodes: int = EPISODES, seed: int = 0) -> Measurement:
    """Compare the reward and its terms in episodes of random actions.

    Many episodes are tried on the reference, and those in which the terms vary most are compared. For example, a reward
    for the last centimeters does not vary far from the goal.

    Args:
        subjects: The simulators, reference first.
        episodes: Number of episodes to compare; each has its own seed and therefore its own goal.
        seed: Seed of the first episode and of the actions.
    """
    reference = subjects[0]
    steps = min(reference.max_episode_steps, _MOST_STEPS)
    with reference.make() as env:
        env.action_space.seed(seed)
        plans = [(seed + k, np.array([env.action_space.sample() for _ in range(steps)])) for k in range(_CANDIDATES)]
    chosen = _liveliest(play(reference, plans), episodes)
    plans = [plans[k] for k in chosen]
    played = [play(subject, plans) for subject in subjects]
    free = [free_steps(reference, rollout) for rollout in played[0]]
    comparisons: list[Comparison] = []
    curves = [
        Line(name, np.arange(1.0, len(values) + 1.0), values, j, i)
        for i, rollouts in enumerate(played)
        for j, (name, values) in enumerate(_joined(rollouts).items())
    ]
    errors_over_time = []
    for i, (subject, rollouts) in enumerate(zip(subjects[1:], played[1:], strict=True), 1):
        comparisons += _judge(reference, subject, (played[0], rollouts), free)
        largest = np.max(list(_errors(played[0], rollouts).values()), axis=0)
        errors_over_time.append(Line(subject.label, np.arange(1.0, len(largest) + 1.0), largest, i))
    return Measurement(
        summary=f"The reward and its terms in {episodes} episodes of {steps} random actions, each with its own seed. "
        f"Of {_CANDIDATES} such episodes on {reference.label}, those in which the terms vary most are used.",
        comparisons=tuple(comparisons),
        facts={
            "moved freely": ", ".join(f"{n} of {rollout.steps}" for n, rollout in zip(free, played[0], strict=True))
            + " steps"
        },
        panels=(
            Panel(title="Reward and terms", x_label="step", y_label="per step", lines=tuple(curves)),
            Panel(
                title="Largest difference of reward or terms",
                x_label="step",
                y_label="per step",
                lines=tuple(errors_over_time),
                tolerance=TOLERANCES["reward"].exact if follows_exactly(*subjects) else None,
                log=True,
            ),
        ),
    )


def _liveliest(rollouts: Sequence[Rollout], episodes: int) -> list[int]:
    """Return the episodes to use: for each term in turn the one in which it varies most, then the next."""
    orders = [
        np.argsort([-float(np.ptp(rollout.rewards[name])) for rollout in rollouts], kind="stable").tolist()
        for name in reversed(list(rollouts[0].rewards))  # the terms before their sum
    ]
    ranked = dict.fromkeys(k for place in zip(*orders, strict=True) for k in place)
    return sorted(list(ranked)[:episodes])


def _joined(rollouts: Sequence[Rollout]) -> dict[str, Floats]:
    """Return the rewards of all episodes, concatenated with gaps."""
    gap = np.array([np.nan])
    return {
        name: np.concatenate([part for rollout in rollouts for part in (rollout.rewards[name], gap)][:-1])
        for name in rollouts[0].rewards
    }


def _errors(first: Sequence[Rollout], second: Sequence[Rollout]) -> dict[str, Floats]:
    """Return the differences of each term in all episodes; NaN at the end if length or terms of an episode differ."""

    def differ(a: Rollout, b: Rollout, name: str) -> Floats:
        n = min(a.steps, b.steps)
        errors = np.abs(a.rewards[name][:n] - b.rewards.get(name, np.full(n, np.nan))[:n])
        return errors if a.steps == b.steps else np.append(errors, np.nan)

    return {
        name: np.concatenate([differ(a, b, name) for a, b in zip(first, second, strict=True)])
        for name in first[0].rewards
    }


def _judge(
    reference: Subject, subject: Subject, played: tuple[Sequence[Rollout], Sequence[Rollout]], free: Sequence[int]
) -> Iterator[Comparison]:
    """Yield the errors of each term while the robot moved freely, and after it touched something."""
    exact = follows_exactly(reference, subject)
    steps = [min(a.steps, b.steps) + (a.steps != b.steps) for a, b in zip(*played, strict=True)]
    moves = [np.arange(n) < free_for for n, free_for in zip(steps, free, strict=True)]
    freely = np.concatenate(moves)
    for name, errors in _errors(*played).items():
        what = "reward" if name == "reward" else f"term {name}"
        span = float(np.ptp(np.concatenate([rollout.rewards[name] for rollout in played[0]])))
        if span < _STANDS and not (errors != 0.0).any():
            yield skip(subject.label, reference.label, "the values do not vary in these episodes", what)
            continue
        for part, chosen in (("", freely), (AFTER_A_TOUCH, ~freely)):
            if chosen.any():
                off = np.where(chosen, errors, 0.0)
                yield judge(
                    "reward", what + part, subject.label, reference.label, off, exact=exact and not part, scale=span,
                    where=f"step {int(np.argmax(np.nan_to_num(off, nan=np.inf))) + 1} of {len(off)}",
                )  # fmt: skip

"""Compares the reward and its terms under random actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_devkit.parity.replay import AFTER_A_TOUCH, Rollout, free_steps, play
from frobs_devkit.parity.result import Comparison, Line, Measurement, Panel, error_panel
from frobs_devkit.parity.under_test import Pair, Subject, pairs_of, tolerance_line

EPISODES = 3
_CANDIDATES = 40  # number of episodes to try on the reference
_MOST_STEPS = 200  # maximum number of steps in an episode
_STANDS = 1e-6  # minimum range of a term that is worth comparing


def rewards(subjects: Sequence[Subject], episodes: int = EPISODES, seed: int = 0) -> Measurement:
    """Compare the reward and its terms in episodes with random actions. Each episode has a different seed.

    Many episodes are tried on the reference, and the episodes in which the terms vary most are compared. A reward for
    the last centimeters, for example, does not vary while the robot is far from the goal.
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
    for i, (pair, rollouts) in enumerate(zip(pairs_of(subjects), played[1:], strict=True), 1):
        comparisons += _judge(pair, (played[0], rollouts), free)
        largest = np.max(list(_errors(played[0], rollouts).values()), axis=0)
        errors_over_time.append(Line(pair.other.label, np.arange(1.0, len(largest) + 1.0), largest, i))
    title = "Largest difference in the reward or its terms"
    moved_freely = ", ".join(f"{n} of {rollout.steps}" for n, rollout in zip(free, played[0], strict=True))
    return Measurement(
        summary=f"The reward and its terms are compared in {episodes} episodes with different seeds and {steps} "
        f"random actions each. The episodes were selected from {_CANDIDATES} episodes on {reference.label} because "
        "their reward terms vary most.",
        comparisons=tuple(comparisons),
        facts={"moved freely": f"{moved_freely} steps"},
        panels=(
            Panel(title="Reward and terms", x_label="step", y_label="per step", lines=tuple(curves)),
            error_panel(title, errors_over_time, "per step", tolerance_line("reward", subjects), "step"),
        ),
    )


def _liveliest(rollouts: Sequence[Rollout], episodes: int) -> list[int]:
    """Return the indices of the episodes in which the reward terms vary most.

    In the first round, each term selects the episode in which it varies most. In each further round, each
    term selects the episode with its next largest variation, until enough episodes are selected.
    """
    orders = [
        np.argsort([-float(np.ptp(rollout.rewards[name])) for rollout in rollouts], kind="stable").tolist()
        for name in reversed(list(rollouts[0].rewards))  # the terms before their sum
    ]
    ranked = dict.fromkeys(k for place in zip(*orders, strict=True) for k in place)
    return sorted(list(ranked)[:episodes])


def _joined(rollouts: Sequence[Rollout]) -> dict[str, Floats]:
    """Return the rewards of all episodes, concatenated with a gap between episodes."""
    gap = np.array([np.nan])
    return {
        name: np.concatenate([part for rollout in rollouts for part in (rollout.rewards[name], gap)][:-1])
        for name in rollouts[0].rewards
    }


def _errors(first: Sequence[Rollout], second: Sequence[Rollout]) -> dict[str, Floats]:
    """Return the absolute differences of each reward term, concatenated over all episodes.

    A NaN is appended for an episode whose length differs. The differences of a missing term are NaN.
    """

    def differ(a: Rollout, b: Rollout, name: str) -> Floats:
        n = min(a.steps, b.steps)
        errors = np.abs(a.rewards[name][:n] - b.rewards.get(name, np.full(n, np.nan))[:n])
        return errors if a.steps == b.steps else np.append(errors, np.nan)

    return {
        name: np.concatenate([differ(a, b, name) for a, b in zip(first, second, strict=True)])
        for name in first[0].rewards
    }


def _judge(
    pair: Pair, played: tuple[Sequence[Rollout], Sequence[Rollout]], free: Sequence[int]
) -> Iterator[Comparison]:
    """Yield separate comparisons of each reward term for the robot's free motion and for the motion after a contact."""
    steps = [min(a.steps, b.steps) + (a.steps != b.steps) for a, b in zip(*played, strict=True)]
    moves = [np.arange(n) < free_for for n, free_for in zip(steps, free, strict=True)]
    freely = np.concatenate(moves)
    for name, errors in _errors(*played).items():
        what = "reward" if name == "reward" else f"term {name}"
        span = float(np.ptp(np.concatenate([rollout.rewards[name] for rollout in played[0]])))
        if span < _STANDS and not (errors != 0.0).any():
            yield pair.skip("the values do not vary in these episodes", what)
            continue
        for part, chosen in (("", freely), (AFTER_A_TOUCH, ~freely)):
            if chosen.any():
                off = np.where(chosen, errors, 0.0)
                where = f"step {int(np.argmax(np.nan_to_num(off, nan=np.inf))) + 1} of {len(off)}"
                exact = False if part else None  # contacts are modeled differently by each engine
                yield pair.judge("reward", what + part, off, exact=exact, scale=span, where=where)

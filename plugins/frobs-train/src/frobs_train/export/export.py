"""Export the policy of a run as a single file for deployment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Algorithm
from frobs_core.util.files import write_aside
from frobs_deploy import BundleError, Policy, pack_bundle, parse_bundle
from frobs_train.evaluation.evaluate import make_evaluation_env, usual_num_envs
from frobs_train.export.export_facts import environment_facts, license_text, training_facts
from frobs_train.runs.policy import load_algorithm
from frobs_train.runs.run import Run

TOLERANCE = 1e-5
"""Largest accepted difference between actions scaled to [−1, 1]. Scores are considered tied if their relative
difference is at most this value.
"""

_ENVS, _OBSERVATIONS = 8, 256


@dataclass(frozen=True, kw_only=True)
class Export:
    """Result of an export."""

    path: Path
    steps: int  # number of environment steps for which the policy was trained
    observations: int  # number of observations used to compare the exported policy with the original
    max_difference: float  # largest difference between actions, scaled to [−1, 1]


def export(
    run: Run, out: Path | None = None, *, checkpoint: str | int = "newest", license: str | None = None
) -> Export:
    """Check that a policy bundle computes the same actions as the algorithm's policy, and write the bundle.

    The default file is ``policy.frobs`` in the run folder. The checkpoint is ``"newest"``, ``"best"`` according to
    evaluations during training, or a number of environment steps. The license is an SPDX identifier such as ``"MIT"``,
    or the path of a text file.
    """
    text = license_text(license)
    count = usual_num_envs(run.config, _ENVS)
    env = make_evaluation_env(run.config, count, run.config.keywords(randomize=False))
    path = run.path / "policy.frobs" if out is None else out
    try:
        algorithm, steps = load_algorithm(run, env.single_observation_space, env.single_action_space, checkpoint)
        graph = algorithm.export_onnx()
        manifest = {
            **environment_facts(env, run.config),
            **training_facts(run, steps),
            "license": license if license is None or not Path(license).is_file() else text.strip().partition("\n")[0],
        }
        manifest["check"] = {"observations": _OBSERVATIONS, "max_difference": 0.0, "tolerance": TOLERANCE}
        tried = Policy(parse_bundle(path, pack_bundle(manifest, graph, text)))
        difference = compare(algorithm, tried, env, run.seeds.evaluation)
    finally:
        env.close()
    if not difference <= TOLERANCE:
        raise BundleError(
            path,
            "the bundle was not written: its actions, scaled to [-1, 1], differ from the actions of the trained policy "
            f"by {difference:.2g}, but the limit is {TOLERANCE:g}; if the network weights have become very large, "
            "train the policy again.",
        )
    manifest["check"]["max_difference"] = float(f"{difference:.3g}")
    data = pack_bundle(manifest, graph, text)
    write_aside(path, lambda aside: aside.write_bytes(data))
    return Export(path=path, steps=steps, observations=_OBSERVATIONS, max_difference=difference)


def compare(algorithm: Algorithm, policy: Policy, env: gym.vector.VectorEnv[Any, Any, Any], seed: int) -> float:
    """Return the largest :func:`difference` between two policies' actions in episodes played by the first policy."""
    observation, _ = env.reset(seed=seed)
    state, start = None, np.ones(env.num_envs, np.bool_)
    policy.reset()
    worst = 0.0
    for _ in range(_OBSERVATIONS // env.num_envs):
        expected, state = algorithm.predict(observation, state, start)
        actual = policy.act(observation)
        worst = max(worst, difference(env.single_action_space, expected, actual, policy.scores))
        if worst == math.inf:  # do not step the environment with non-finite actions
            break
        observation, _, terminated, truncated, _ = env.step(expected)
        start = terminated | truncated
        policy.reset(start)
    return worst


def difference(space: gym.Space[Any], expected: Any, found: Any, scores: Any) -> float:
    """Return the largest difference between two batches of actions.

    Actions in a Box are scaled to [−1, 1]. For discrete actions, the difference is 2 if any two actions differ and
    their scores are not tied, else 0. The array of scores has the shape (n, choices).
    """
    if isinstance(space, gym.spaces.Box):
        half = np.maximum((space.high.astype(float) - space.low) / 2.0, np.finfo(np.float32).tiny)
        worst = float(np.max(np.abs(np.asarray(found, float) - np.asarray(expected, float)) / half, initial=0.0))
        return worst if math.isfinite(worst) else math.inf
    n = len(scores)
    choices, exported = np.asarray(expected).reshape(n, -1).astype(int), np.asarray(found).reshape(n, -1).astype(int)
    for row, column in np.argwhere(choices != exported).tolist():
        two = _scores_of(space, scores[row], column, (choices[row, column], exported[row, column]))
        if abs(two[0] - two[1]) > TOLERANCE * max(1.0, abs(two[0]), abs(two[1])):
            return 2.0
    return 0.0


def _scores_of(space: gym.Space[Any], scores: Any, column: int, choices: tuple[int, int]) -> tuple[float, float]:
    if isinstance(space, gym.spaces.MultiBinary):  # the action is 1 in columns with a positive logit, else 0
        return float(scores[column]), 0.0
    first = int(space.nvec[:column].sum()) if isinstance(space, gym.spaces.MultiDiscrete) else 0
    return float(scores[first + choices[0]]), float(scores[first + choices[1]])

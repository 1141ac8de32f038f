"""Episodes of Python that a page repeats, and the comparison in node, without a browser."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from frobs_train import BundleRun, make_env

TRIALS = Path(__file__).with_name("page_trials.mjs")


def run_with(run: BundleRun, **keywords: Any) -> BundleRun:
    """Return a run with other keywords of its environment, for which its policy was not trained."""
    changed = BundleRun(run.bundle, trust=True)
    kwargs = {**run.config.environment_kwargs, **keywords}
    changed.config = run.config.model_copy(update={"environment_kwargs": kwargs})
    return changed


def play(run: BundleRun, episodes: int, detailed: int, *, random: bool = False) -> list[dict[str, Any]]:
    """Play episodes from the starts of a page, as ``page_trials.mjs`` reads them.

    Args:
        run: The bundle.
        episodes: Number of episodes.
        detailed: Number of episodes of which each step is stored.
        random: Whether random actions are played instead of those of the policy, and no outcomes are stored.
    """
    env = make_env(run.config.environment, run.config.keywords(randomize=False))
    base: Any = env.unwrapped
    policy = None if random else run.policy(env.observation_space, env.action_space)
    rng = np.random.default_rng(0)
    played = []
    for number in range(episodes):
        observation, info = env.reset(seed=number)
        episode: dict[str, Any] = {"start": number}
        steps: dict[str, list[Any]] = {"actions": [], "observations": [], "controls": [], "positions": []}
        start, done = np.ones(1, np.bool_), False
        while not done:
            if policy is None:
                action = rng.uniform(-1.2, 1.2, env.action_space.shape)
            else:
                action = policy.act(_batch(observation), start)[0]
            start = np.zeros(1, np.bool_)
            if number < detailed:
                steps["observations"].append(_vectors(base.observations.terms))
                steps["actions"].append(np.asarray(action, float).tolist())
            observation, _, terminated, truncated, info = env.step(action)
            done = terminated or truncated
            if number < detailed:
                steps["controls"].append(base.simulation.states["ctrl"][0].tolist())
                steps["positions"].append(base.simulation.states["qpos"][0].tolist())
        if number < detailed:
            episode |= steps
        if not random:
            episode["success"] = bool(info["is_success"])
        played.append(episode)
    env.close()
    return played


def _batch(observation: Any) -> Any:
    if isinstance(observation, Mapping):
        return {key: value[None] for key, value in observation.items()}
    return observation[None]


def _vectors(terms: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the values of terms as float64 by key, before they are rounded to float32."""
    vectors: dict[str, list[float]] = {}
    for term in terms.values():
        vectors.setdefault(term.key, []).extend(np.ravel(term.read()).tolist())
    return vectors


def compare(page: Path, episodes: list[dict[str, Any]]) -> dict[str, Any]:
    """Play episodes in a page with node, and return the deviations that ``page_trials.mjs`` prints."""
    path = page / "trials.json"
    path.write_text(json.dumps(episodes), "utf-8")
    search = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    node = shutil.which("node", path=search)
    assert node is not None, "'make page' installs node"
    done = subprocess.run([node, TRIALS, page, path], capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))

"""Evaluate the policy during training, and save the best policy."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Algorithm
from frobs_core.util.errors import CheckpointError
from frobs_train.evaluation.evaluate import make_evaluation_env, usual_num_envs
from frobs_train.evaluation.playing import play_episodes
from frobs_train.runs import checkpoints
from frobs_train.runs.policy import AlgorithmPolicy
from frobs_train.runs.run import Run
from frobs_train.runs.state import read_best, write_best
from frobs_train.training.interrupts import Interrupts

_log = logging.getLogger("frobs")


class _InterruptedError(Exception):
    """A signal was received during an evaluation."""


class TrainingEvaluation:
    """Evaluation of the deterministic policy during training, on the same episodes each time.

    Evaluations use separate environments and therefore do not affect training. A signal that ``interrupts`` receives
    ends the current evaluation. ``latest`` is the success rate in the last evaluation, or the mean reward if the
    environment does not report success.
    """

    def __init__(self, run: Run, algorithm: Algorithm, interrupts: Interrupts) -> None:
        self._run = run
        self._algorithm = algorithm
        self._interrupts = interrupts
        self._env: gym.vector.VectorEnv[Any, Any, Any] | None = None
        self._success: float | None = None
        self._best = _best_so_far(run)
        self.latest: float | None = None

    def evaluate(self, steps: int) -> dict[str, float]:
        """Evaluate the policy, save it if it is the best so far, and return columns for the log."""
        config = self._run.config
        if self._env is None:
            count = usual_num_envs(config, config.evaluation_episodes)
            self._env = make_evaluation_env(config, count, config.keywords(randomize=False))
        seed = self._run.seeds.validation
        try:
            episodes = play_episodes(
                self._env,
                AlgorithmPolicy(self._algorithm),
                config.evaluation_episodes,
                seed,
                on_progress=self._stop_if_interrupted,
                longest_episode=config.longest_episode,
            )
        except _InterruptedError:
            _log.warning("The evaluation after %s steps was interrupted, so the log does not contain it.", f"{steps:,}")
            return {}
        self._success = float(np.mean(episodes.successes)) if episodes.successes else None
        reward = float(np.mean(episodes.rewards))
        if self._success is None and self.latest is None and config.stop_at_success is not None:
            _log.warning("stop_at_success has no effect, because %s does not report success.", config.environment)
        self.latest = reward if self._success is None else self._success
        rank = (0.0 if self._success is None else self._success, reward)
        if self._best is None or rank > self._best:
            self._keep(steps, rank)
            self._best = rank
        row = {} if self._success is None else {"evaluation/success": self._success}
        return {**row, "evaluation/reward": reward, "evaluation/length": float(np.mean(episodes.lengths))}

    def why_stop(self) -> str | None:
        """Return why training should end, or None if training should continue."""
        target = self._run.config.stop_at_success
        if target is None or self._success is None or self._success < target:
            return None
        return (
            f"an evaluation measured {100 * self._success:.1f} % success, and stop_at_success is {100 * target:.1f} %"
        )

    def close(self) -> None:
        """Close the environments. Further calls have no effect."""
        if self._env is not None:
            self._env.close()
            self._env = None

    def _stop_if_interrupted(self, finished: int) -> None:
        if self._interrupts.requested is not None:
            raise _InterruptedError

    def _keep(self, steps: int, rank: tuple[float, float]) -> None:
        def save(folder: Path) -> None:
            (folder / "algorithm").mkdir()
            self._algorithm.save_policy(folder / "algorithm")
            write_best(folder, steps, rank)

        checkpoints.write_best(self._run.path / "checkpoints", save)


def _best_so_far(run: Run) -> tuple[float, float] | None:
    """Return the rank of the saved best policy, or None if no policy has been saved.

    A run that resumes from an earlier checkpoint must keep this policy until a better policy is found.
    """
    try:
        checkpoint, _ = run.find_checkpoint("best")
        return read_best(checkpoint.path)[1]
    except CheckpointError:
        return None

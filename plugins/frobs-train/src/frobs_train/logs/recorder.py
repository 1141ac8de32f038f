"""Record the episodes of a vector environment."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from frobs_core.util.arrays import Floats
from frobs_train.environment_checks import TERM_PREFIX, EpisodeChecks, fault_named
from frobs_train.errors import EnvironmentFaultError

if TYPE_CHECKING:
    from frobs_train.environments import EnvironmentRecipe

FROM_PATH = "frobs/from_path"
"""Key of a Boolean array, (num_envs,), in ``final_info``. The array is True for episodes that began on an expert's
path. These episodes are excluded from the statistics."""


@dataclass(frozen=True)
class FinishedEpisodes:
    """Results of the n episodes that ended at the same step. All arrays have shape (n,)."""

    env_ids: npt.NDArray[np.intp]  # indices of the environments in which the episodes ended
    rewards: Floats  # undiscounted return of each episode
    lengths: npt.NDArray[np.int64]  # [control steps]
    successes: Floats | None  # 1.0 or 0.0, or None if the environment does not report success
    terms: Mapping[str, Floats]  # sum of each reward term over each episode


class EpisodeRecorder(gym.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """Wrapper that reports finished episodes and stops at errors, without changing the behavior of the environment.

    Observations, rewards, actions and metrics must be finite, also if a space has bounds of infinity.

    Like Gymnasium's ``RecordEpisodeStatistics``, the wrapper adds ``episode`` and ``_episode`` to ``info``.

    Args:
        env: A vector environment with same-step autoreset.
        on_episodes: Called with the finished episodes after each step in which an episode ends.
        recipe: Recipe from which algorithms can make additional environments in other processes, or None if unknown.
        longest_episode: Number of steps after which an episode is an error, or None to accept episodes of any length.

    Attributes:
        steps: Number of environment steps so far, summed over all environments.
        checks: Checks of the environment, which also count the steps of the running episodes.

    Raises:
        NonFiniteValueError: A value is not finite. Raised by :meth:`reset` and :meth:`step`, as the following errors.
        EnvironmentFaultError: The environment raised an exception.
        EndlessEpisodeError: An episode is longer than ``longest_episode``.
    """

    def __init__(
        self,
        env: gym.vector.VectorEnv[Any, Any, Any],
        on_episodes: Callable[[FinishedEpisodes], None],
        recipe: EnvironmentRecipe | None = None,
        longest_episode: int | None = None,
    ) -> None:
        super().__init__(env)
        self.recipe = recipe
        self.steps = 0
        self._on_episodes = on_episodes
        self._rewards: Floats = np.zeros(env.num_envs)
        self.checks = EpisodeChecks(env, longest_episode)
        self._terms: dict[str, Floats] = {}
        self._has_success = False  # whether an episode has reported it

    def add_elsewhere(self, finished: FinishedEpisodes) -> None:
        """Report episodes of environments that the algorithm steps in other processes."""
        for name in finished.terms:
            self._terms.setdefault(name, np.zeros(self.num_envs))
        self._on_episodes(finished)

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the reward terms seen so far."""
        return tuple(self._terms)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset all environments."""
        self._rewards[:] = 0.0
        self.checks.lengths[:] = 0
        for sums in self._terms.values():
            sums[:] = 0.0
        with fault_named(self.checks.environment, "reset"):
            observation, info = self.env.reset(seed=seed, options=options)
        self.checks.check_observation(observation)
        return observation, info

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step the environments, and add up rewards and episode lengths."""
        self.checks.check_action(actions)
        with fault_named(self.checks.environment, "step"):
            observation, rewards, terminated, truncated, info = self.env.step(actions)
        self.checks.count_step(rewards, info)
        self.steps += self.num_envs
        if np.ndim(info.get("is_success", 0)) > 1:
            self._successes(info)
        self._rewards += rewards
        done = terminated | truncated
        any_done = done.any()
        self._add_terms(info, done if any_done else None)
        if any_done:
            self._finish(done, info)
        self.checks.check_observation(observation)
        return observation, rewards, terminated, truncated, info

    def snapshot(self) -> dict[str, np.ndarray[Any, Any]] | None:
        """Return the state of the environment, wrappers and recorder, or None if snapshots are not supported."""
        base: Any = self.unwrapped
        if not hasattr(base, "snapshot"):
            return None
        state: dict[str, np.ndarray[Any, Any]] = dict(base.snapshot())
        for index, wrapper in enumerate(saving_wrappers(self.env)):
            state |= {f"wrapper/{index}/{name}": array for name, array in wrapper.snapshot().items()}
        state |= {"recorder/rewards": self._rewards.copy(), "recorder/lengths": self.checks.lengths.copy()}
        state |= {f"recorder/terms/{name}": sums.copy() for name, sums in self._terms.items()}
        return state

    def restore(self, snapshot: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Restore a snapshot."""
        self._rewards[:] = snapshot["recorder/rewards"]
        self.checks.lengths[:] = snapshot["recorder/lengths"]
        self._terms = {name: np.array(sums) for name, sums in _below("recorder/terms/", snapshot).items()}
        for index, wrapper in enumerate(saving_wrappers(self.env)):
            wrapper.restore(_below(f"wrapper/{index}/", snapshot))
        base: Any = self.unwrapped
        base.restore({key: value for key, value in snapshot.items() if not key.startswith(("recorder/", "wrapper/"))})

    def metrics(self) -> dict[str, float]:
        """Return the metrics that the wrappers report for the log."""
        return {
            name: value
            for each in saving_wrappers(self.env)
            if hasattr(each, "metrics")
            for name, value in each.metrics().items()
        }

    def _add_terms(self, info: Mapping[str, Any], done: npt.NDArray[np.bool_] | None) -> None:
        # If an episode ended, its last terms are in final_info, because info already describes the next episode.
        final = info.get("final_info", {}) if done is not None else {}
        for key in info if not final else {**info, **final}:
            if key.startswith(TERM_PREFIX):
                name = key.removeprefix(TERM_PREFIX)
                if name not in self._terms:
                    self._terms[name] = np.zeros(self.num_envs)
                if done is None:
                    self._terms[name] += info[key]
                else:
                    self._terms[name] += np.where(done, final.get(key, 0.0), info.get(key, 0.0))

    def _successes(self, info: Mapping[str, Any]) -> Floats:
        """Return 1.0 or 0.0 for each environment, (num_envs,). An environment that reports no success has failed."""
        try:
            found = np.where(info.get("_is_success", True), info.get("is_success", np.zeros(self.num_envs)), 0.0)
            found = found.astype(np.float64)
        except (TypeError, ValueError):
            found = np.empty(0)
        known = found[np.isfinite(found)]  # check_metric names the other ones
        if found.shape != (self.num_envs,) or (known < 0.0).any() or (known > 1.0).any():
            raise EnvironmentFaultError(
                self.checks.environment,
                "returns an info whose is_success is neither True nor False; return bool(…) of a single value.",
            )
        return found

    def _finish(self, done: npt.NDArray[np.bool_], info: dict[str, Any]) -> None:
        batch = getattr(self.unwrapped, "final_observation", None)
        self.checks.check_final(info["final_obs"] if batch is None else batch, np.flatnonzero(done))
        final = info.get("final_info", {})
        counted = done & ~final[FROM_PATH] if FROM_PATH in final else done
        ids = np.flatnonzero(counted)
        self._has_success |= "is_success" in final
        successes = self._successes(final)[ids] if self._has_success else None
        terms = {name: sums[ids] for name, sums in self._terms.items()}
        for name, values in {**terms, **({} if successes is None else {"is_success": successes})}.items():
            self.checks.check_metric(name, values, ids)
        lengths = self.checks.lengths
        finished = FinishedEpisodes(ids, self._rewards[ids], lengths[ids], successes, terms)
        info["episode"] = {"r": np.where(done, self._rewards, 0.0), "l": np.where(done, lengths, 0)}
        info["_episode"] = done
        self._rewards[done] = 0.0
        self.checks.begin_again(done)
        for sums in self._terms.values():
            sums[done] = 0.0
        if len(ids):
            self._on_episodes(finished)


def wrappers_of(env: Any) -> Iterator[Any]:
    """Yield the vector wrappers around an environment, from the outside in."""
    while isinstance(env, gym.vector.VectorWrapper):
        yield env
        env = env.env


def saving_wrappers(env: Any) -> list[Any]:
    """Return the vector wrappers around an environment that support snapshots."""
    return [one for one in wrappers_of(env) if hasattr(type(one), "snapshot") and hasattr(type(one), "restore")]


def _below(prefix: str, snapshot: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    return {key.removeprefix(prefix): value for key, value in snapshot.items() if key.startswith(prefix)}

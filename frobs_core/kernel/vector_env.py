"""Gymnasium vector environment that steps many environments with the same task in a single call.

If the simulator's ``determinism`` is exact, environment *i* of a vector environment seeded with *s* is bit-identical to
a single environment seeded with *s + i*.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from frobs_core.contracts import Snapshot
from frobs_core.deprecation import deprecated
from frobs_core.description import Observation
from frobs_core.kernel.env import ComposedEnv
from frobs_core.kernel.inputs import check_actions, check_reset_mask, check_seeds, option_mapping
from frobs_core.kernel.viewers import open_viewer
from frobs_core.util.arrays import Mask, rows_of
from frobs_core.util.errors import ParameterValueError, ResetNeededError
from frobs_core.util.validation import boolean, whole_number


class RobotVectorEnv(ComposedEnv, gym.vector.VectorEnv[Any, Any, Any]):
    """Gymnasium vector environment of ``num_envs`` environments with the same task.

    ``info`` follows Gymnasium's convention for vector environments: each key contains an array of values, and ``_key``
    contains a mask of the environments whose values are valid. With same-step autoreset, ``final_obs`` and
    ``final_info`` describe the last step of each finished episode. For adapters, :attr:`final_observation` contains the
    same observations as a single batch.

    Args:
        num_envs: ≥ 1.
        max_episode_steps: Number of control steps ≥ 1 before truncation, or None or −1 for no time limit.
        autoreset_mode: Autoreset mode: same-step, next-step or disabled.
        stagger: Whether a reset without ``"reset_mask"`` starts each environment at a random step count, so that the
            episodes do not all reach the time limit at the same step.
        keywords: Fields of :class:`frobs_core.kernel.config.EnvConfig`. All other keywords are passed to the task.

    All attributes of :class:`~frobs_core.kernel.env.RobotEnv` exist here too.

    Attributes:
        final_observation: Final observations of the latest step in which episodes ended, (num_envs, …). Only the rows
            of environments whose episode ended are valid.
        before_autoreset: Functions to call before each automatic reset.

    Raises:
        ParameterValueError: ``max_episode_steps`` or ``stagger`` is invalid, or ``stagger`` is set without a time limit.
        FrobsError: See :class:`~frobs_core.kernel.env.RobotEnv`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        stagger: bool = False,
        **keywords: Any,
    ) -> None:
        limit = math.inf if max_episode_steps in (None, -1) else whole_number("max_episode_steps", max_episode_steps, 1)
        if boolean("stagger", stagger) and limit == math.inf:
            raise ParameterValueError("stagger", stagger, "False without a time limit")
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        parts = self._compose(keywords, num_envs)
        self.before_autoreset = self._loop.before_autoreset
        self.num_envs = num_envs
        self.single_action_space = parts.control.action_space
        self.single_observation_space = parts.observations.space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.metadata["autoreset_mode"] = self.autoreset_mode
        self.max_episode_steps = limit
        self._stagger = stagger
        self.final_observation: Observation | None = None
        self._elapsed = np.zeros(num_envs, np.int64)
        self._ended = np.ones(num_envs, np.bool_)  # environments that wait for a reset
        self._none = np.zeros(num_envs, np.bool_)
        self._all = np.ones(num_envs, np.bool_)
        self.viewer = open_viewer(self, self.render_mode)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes.

        Args:
            seed: With an integer s, environment *i* is seeded with s + i. A list must contain one seed for each
                environment. With None, each environment continues its current random sequence.
            options: Values for the task's ``reset_options``, either one value for all environments or one row per
                environment. The additional option ``"reset_mask"``, (num_envs,) bool, selects the environments to
                reset.

        Returns:
            Tuple of observations and info.

        Raises:
            UnknownParameterError: The task does not accept one of the options.
            ConfigurationError: An option is invalid.
        """
        given = option_mapping(options)
        mask = given.pop("reset_mask", None)
        return self.reset_rows(seed, None if mask is None else check_reset_mask(mask, self.num_envs), given)

    def reset_rows(
        self, seed: int | Sequence[int | None] | None, mask: Mask | None, options: Mapping[str, Any]
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes in the environments of a mask, which may select none of them, and return as :meth:`reset`.

        For the errors, see :meth:`reset`.
        """
        batched = self._loop.batch_options(options)
        self._seed(seed, mask)
        if mask is not None and not mask.any():
            return self._loop.observe(mask), self._reset_info(mask)
        rows = rows_of(mask)
        self._elapsed[rows] = 0
        if self._stagger and mask is None:
            drawn = self._loop.rng.uniform("stagger")
            self._elapsed[:] = np.floor(drawn * self.max_episode_steps)
        observation = self._loop.begin(mask, batched)
        self._ended[rows] = False
        if self.viewer is not None:
            self.viewer.update()
        return observation, self._reset_info(self._all if mask is None else mask)

    def _reset_info(self, mask: Mask) -> dict[str, Any]:
        if self.randomization is None:
            return {}
        drawn: dict[str, Any] = {}
        for name, values in self.randomization.values.items():
            drawn[name], drawn[f"_{name}"] = values, mask
        return {"frobs/randomization": drawn, "_frobs/randomization": mask}

    def _seed(self, seed: int | Sequence[int | None] | None, mask: Mask | None) -> None:
        rng = self._loop.rng
        if seed is None or isinstance(seed, (int, np.integer)):
            super().reset(seed=None if seed is None else int(seed))
            if seed is not None or not self._seeded:
                base = self.np_random_seed
                assert base is not None
                seeds = [base + i for i in range(self.num_envs)]
                if not self._seeded or mask is None:
                    rng.seed(seeds)
                else:
                    rng.seed([s for s, chosen in zip(seeds, mask, strict=True) if chosen], mask)
        else:
            seed = check_seeds(seed, self.num_envs)
            if not self._seeded:
                rng.seed([int(self.np_random.integers(2**63)) for _ in range(self.num_envs)])
            chosen = np.array([s is not None for s in seed]) & (self._all if mask is None else mask)
            rng.seed([int(s) for s, is_chosen in zip(seed, chosen, strict=True) if is_chosen and s is not None], chosen)
        self._seeded = True

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance all environments by one control step.

        Args:
            actions: Actions in the batched action space, (num_envs, …). Actions outside the bounds of a Box space are
                clipped.

        Returns:
            Tuple of observations, rewards (num_envs,) float64, terminations and truncations (num_envs,) bool, and info.

        Raises:
            InvalidActionError: The actions have the wrong shape or are not finite.
            ResetNeededError: ``reset`` has not been called, or an episode has ended and autoreset is disabled.
        """
        waiting = self._ended if self._ended.any() else None
        if waiting is not None:
            require_episodes(self.idle())
        # Invalid actions raise an error before any state changes, including the random state.
        checked = check_actions(actions, self.action_space)
        if waiting is not None:
            for callback in self.before_autoreset:
                callback(waiting.copy())
        if waiting is not None and waiting.all():  # next-step autoreset: actions are ignored, so no robot moves
            self._elapsed[:], self._ended = 0, self._none.copy()
            observation = self._loop.begin(None, {})
            none, zeros = self._none.copy(), np.zeros(self.num_envs)
            return observation, zeros, none, none.copy(), {"is_success": zeros.copy(), "_is_success": none.copy()}
        observation, rewards, ends, diverged, infos = self._loop.step(checked)
        self._elapsed += 1
        reward = rewards.copy()
        terminated = self._none.copy() if ends is None else ends.copy()
        truncated = self._elapsed >= self.max_episode_steps
        info: dict[str, Any] = {"is_success": infos.pop("is_success").astype(np.float64), "_is_success": self._all}
        for name, values in infos.items():
            info[name], info["_" + name] = values.copy(), self._all
        if diverged is not None:
            truncated |= diverged
            reward[diverged] = 0.0
            info["frobs/diverged"], info["_frobs/diverged"] = diverged, diverged

        if waiting is not None:  # next-step autoreset: these environments begin an episode and ignore their actions
            reset = waiting.copy()
            observation = self._begin_again(reset, observation)
            reward[reset], terminated[reset], truncated[reset] = 0.0, False, False
            info = {name: (~reset if name.startswith("_") else values) for name, values in info.items()}
        done = terminated | truncated
        if done.any():
            if self.autoreset_mode is AutoresetMode.SAME_STEP:
                self.final_observation = observation
                info = _final_info(observation, info, done)
                for callback in self.before_autoreset:
                    callback(done.copy())
                observation = self._begin_again(done, observation)
            else:
                self._ended = done | (self._ended if self.autoreset_mode is AutoresetMode.DISABLED else self._none)
        return observation, reward, terminated, truncated, info

    def _begin_again(self, mask: Mask, observation: Observation) -> Observation:
        """Reset the environments selected by ``mask`` and insert their first observations into ``observation``."""
        self._elapsed[mask] = 0
        fresh = self._loop.begin(mask, {})
        self._ended = self._none.copy()
        if isinstance(observation, dict):
            assert isinstance(fresh, dict)
            return {key: _merge(observation[key], fresh[key], mask) for key in observation}
        assert isinstance(fresh, np.ndarray)
        return _merge(observation, fresh, mask)

    def idle(self) -> Mask:
        """Return a mask of the environments that cannot take a step before a reset, (num_envs,) bool."""
        return self._none if self._seeded and self.autoreset_mode is AutoresetMode.NEXT_STEP else self._ended

    def read_terms(self, settings: Mapping[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
        """Read observation terms outside the observation, (num_envs, …) each.

        For the arguments and errors, see :meth:`frobs_core.kernel.env.RobotEnv.read_terms`.
        """
        return self._loop.read_terms(settings)

    def render(self) -> tuple[Any, ...] | None:
        """Return one image per environment, (height, width, 3) uint8, if ``render_mode`` is ``"rgb_array"``."""
        pictures = self._pictures()
        return None if pictures is None else tuple(pictures)

    def snapshot(self) -> Snapshot:
        """Return the complete state.

        If the simulator supports exact snapshots, a restored environment continues exactly like the original.
        """
        return {**self._loop.snapshot(), "elapsed": self._elapsed.copy(), "ended": self._ended.copy()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this environment or of another environment with the same configuration."""
        self._loop.restore(snapshot)
        self._elapsed[:], self._ended = snapshot["elapsed"], snapshot["ended"].copy()
        self._seeded = True

    def restore_rows(self, mask: Mask, snapshot: Snapshot, rows: npt.NDArray[np.int64]) -> None:
        """Restore some environments from rows of a snapshot, without changing their random streams.

        Args:
            mask: Mask that selects n environments, (num_envs,) bool.
            snapshot: Snapshot of this environment or of another environment with the same configuration. The snapshot
                may have any number of rows.
            rows: Indices of the snapshot's rows, (n,).
        """
        self._loop.restore_rows(mask, snapshot, rows)
        self._elapsed[mask], self._ended[mask] = snapshot["elapsed"][rows], snapshot["ended"][rows]

    @deprecated(instead="after_reset.append", since="0.3", removed_in="0.4")
    def call_after_reset(self, callback: Callable[[Mask | None], None]) -> None:
        """Add ``callback`` to ``after_reset``."""
        self.after_reset.append(callback)

    def close_extras(self, **kwargs: Any) -> None:
        """Release the simulation."""
        self._release()


def require_episodes(idle: Mask) -> None:
    """Raise ResetNeededError if an environment is ``idle``: a mask of those without a running episode, (num_envs,)."""
    if idle.any():
        which = np.flatnonzero(idle).tolist()
        raise ResetNeededError(f"no episode is running in environments {which[:8]}; call reset() first.")


def _merge(rows: np.ndarray[Any, Any], fresh: np.ndarray[Any, Any], mask: Mask) -> np.ndarray[Any, Any]:
    merged = rows.copy()  # do not modify ``rows``, which are also the final observation
    merged[mask] = fresh[mask]
    return merged


def _final_info(observation: Observation, info: dict[str, Any], done: Mask) -> dict[str, Any]:
    """Return the info with ``final_obs`` and ``final_info`` of ended episodes, in Gymnasium's format."""
    final_obs = np.full(len(done), None, dtype=object)
    for i in np.flatnonzero(done):
        final_obs[i] = (
            {key: values[i] for key, values in observation.items()} if isinstance(observation, dict) else observation[i]
        )
    final = {name: (values & done if name.startswith("_") else values) for name, values in info.items()}
    going = {name: (values & ~done if name.startswith("_") else values) for name, values in info.items()}
    return {**going, "final_obs": final_obs, "_final_obs": done, "final_info": final, "_final_info": done}

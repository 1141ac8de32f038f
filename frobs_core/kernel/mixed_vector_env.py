"""Vector environment whose environments run on several simulators, and the entry point of all vector environments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector.utils import batch_space

from frobs_core.contracts import GoalTask, Snapshot
from frobs_core.description import Observation
from frobs_core.kernel.copying import CopiedByArguments
from frobs_core.kernel.inputs import batch_options, check_actions, check_reset_mask, check_seeds, option_mapping
from frobs_core.kernel.robot_config import find_record
from frobs_core.kernel.vector_env import RobotVectorEnv, require_episodes
from frobs_core.kernel.viewers import PICTURE, Metadata
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.errors import ConfigurationError, ParameterValueError, SimulationError
from frobs_core.util.validation import whole_number


def make_vector_env(num_envs: int | Mapping[str, int] = 1, **keywords: Any) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Make a vector environment. ``gymnasium.make_vec`` calls this function for the IDs of FRobs.

    Args:
        num_envs: Number of environments ≥ 1, or the number for each simulator, such as
            ``{"mujoco": 48, "pybullet": 16}``.
        keywords: Keywords of :class:`~frobs_core.kernel.vector_env.RobotVectorEnv`. ``simulator`` has no effect if
            ``num_envs`` names simulators.

    Raises:
        FrobsError: See :class:`MixedVectorEnv` and :class:`~frobs_core.kernel.vector_env.RobotVectorEnv`.
    """
    return (
        MixedVectorEnv(num_envs, **keywords) if isinstance(num_envs, Mapping) else RobotVectorEnv(num_envs, **keywords)
    )


class MixedVectorEnv(CopiedByArguments, gym.vector.VectorEnv[Any, Any, Any]):
    """Gymnasium vector environment whose environments have the same task, but run on several simulators.

    The rows are in the order of ``num_envs``: first all environments of the first simulator. With the same seeds and
    actions, each row is bit-identical to the same row of a vector environment on its simulator alone. An integer seed s
    seeds row *i* with s + i, as in every vector environment, so the environments of the second simulator, which begin at
    row k, equal those of a :class:`~frobs_core.kernel.vector_env.RobotVectorEnv` seeded with s + k.

    ``info`` follows Gymnasium's convention. For a key that only some simulators report, the mask of the key excludes
    the rows of the others. Callbacks, handles and row-wise restoring belong to one simulator, so use those of
    :attr:`parts`.

    Args:
        num_envs: Number of environments ≥ 1 for each simulator, by its name.
        keywords: Keywords of :class:`~frobs_core.kernel.vector_env.RobotVectorEnv`. Only ``render_mode="rgb_array"`` is
            supported, because viewers show one simulation.

    Attributes:
        parts: The vector environment on each simulator, by its name.
        rows: Slice of the rows of each simulator, by its name.
        config: Keywords of the first simulator's environments.
        observations: Observation terms of the first simulator, for their columns and units.

    Raises:
        ParameterValueError: ``num_envs`` is empty or a number is invalid, a simulator is paced, or ``render_mode`` is a
            viewer.
        ConfigurationError: The spaces or timesteps differ between the simulators.
        FrobsError: See :class:`~frobs_core.kernel.vector_env.RobotVectorEnv`.
    """

    metadata = Metadata()

    def __init__(self, num_envs: Mapping[str, int], **keywords: Any) -> None:
        _check_simulators(num_envs)
        if keywords.get("render_mode") not in (None, PICTURE):
            raise ParameterValueError(
                "render_mode", keywords["render_mode"], f"{PICTURE!r} or None with several simulators"
            )
        self.parts: dict[str, RobotVectorEnv] = {}
        self.rows: dict[str, slice] = {}
        self.num_envs = 0
        try:
            for name, count in num_envs.items():
                self.parts[name] = RobotVectorEnv(count, **{**keywords, "simulator": name})
                self.rows[name] = slice(self.num_envs, self.num_envs + count)
                self.num_envs += count
            _check_same(self.parts)
        except BaseException:
            self.close_extras()
            raise
        self._first = first = next(iter(self.parts.values()))
        self.config, self.render_mode, self.metadata = first.config, first.render_mode, first.metadata
        self.autoreset_mode, self.max_episode_steps = first.autoreset_mode, first.max_episode_steps
        self.control_timestep, self.observations = first.control_timestep, first.observations
        self.single_action_space = first.single_action_space
        self.single_observation_space = first.single_observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        if isinstance(first.task, GoalTask):
            self.compute_reward = first.task.compute_reward  # hindsight experience replay calls this method

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes.

        For the arguments and errors, see :meth:`frobs_core.kernel.vector_env.RobotVectorEnv.reset`.
        """
        given = option_mapping(options)
        mask = given.pop("reset_mask", None)
        mask = None if mask is None else check_reset_mask(mask, self.num_envs)
        batched = batch_options(given, self._first.task.reset_options, self.num_envs)
        seeds: list[Any]
        if seed is None or isinstance(seed, int | np.integer):
            super().reset(seed=None if seed is None else int(seed))
            seeds = [None if seed is None else int(seed) + rows.start for rows in self.rows.values()]
        else:
            seeds = self.split(check_seeds(seed, self.num_envs))
        results = []
        for (name, part), own_seed in zip(self.parts.items(), seeds, strict=True):
            rows = self.rows[name]
            # one value for all environments, or one row per environment
            own = {key: value if np.ndim(value) < 2 else batched[key][rows] for key, value in given.items()}
            results.append(part.reset_rows(own_seed, None if mask is None else mask[rows], own))
        observations, infos = zip(*results, strict=True)
        return _join(observations), self._join_infos(infos)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance all environments by one control step.

        For the arguments, results and errors, see :meth:`frobs_core.kernel.vector_env.RobotVectorEnv.step`.

        Raises:
            SimulationError: An engine failed. The message names the simulator.
        """
        require_episodes(np.concatenate([part.idle() for part in self.parts.values()]))
        checked = check_actions(actions, self.action_space)  # before any simulator takes a step
        results = []
        for name, part in self.parts.items():
            try:
                results.append(part.step(checked[self.rows[name]]))
            except SimulationError as error:
                raise SimulationError(f"simulator '{name}': {error}") from error
        observations, rewards, terminated, truncated, infos = zip(*results, strict=True)
        joined = _join(observations), np.concatenate(rewards), np.concatenate(terminated), np.concatenate(truncated)
        return *joined, self._join_infos(infos)

    @property
    def final_observation(self) -> Observation | None:
        """Final observations of the latest step in which episodes ended, as in ``RobotVectorEnv``, (num_envs, …)."""
        finals = [part.final_observation for part in self.parts.values()]
        known = next((final for final in finals if final is not None), None)
        if known is None:
            return None
        for index, part in enumerate(self.parts.values()):
            if finals[index] is None:  # no episode has ended here, so these rows are not valid
                finals[index] = _take(known, np.zeros(part.num_envs, np.intp))
        joined: Observation = _join(finals)
        return joined

    def split(self, batch: Any) -> list[Any]:
        """Return the rows of an array, or of each array of a dictionary, for each simulator."""
        return [_take(batch, rows) for rows in self.rows.values()]

    def read_terms(self, settings: Mapping[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
        """Read observation terms outside the observation, (num_envs, …) each.

        For the arguments and errors, see :meth:`frobs_core.kernel.env.RobotEnv.read_terms`.
        """
        read: dict[str, np.ndarray[Any, Any]] = _join([part.read_terms(settings) for part in self.parts.values()])
        return read

    def render(self) -> tuple[Any, ...] | None:
        """Return one image per environment, (height, width, 3) uint8, if ``render_mode`` is ``"rgb_array"``."""
        if self.render_mode is None:
            return None
        return tuple(picture for part in self.parts.values() for picture in part.render() or ())

    def snapshot(self) -> Snapshot:
        """Return the complete state, with the name of its simulator before the name of each array."""
        return {f"{name}/{key}": array for name, part in self.parts.items() for key, array in part.snapshot().items()}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this environment or of another environment with the same arguments."""
        for name, part in self.parts.items():
            prefix = f"{name}/"
            part.restore({key.removeprefix(prefix): value for key, value in snapshot.items() if key.startswith(prefix)})

    def close_extras(self, **kwargs: Any) -> None:
        """Release all simulations, also if one of them fails to close."""
        with ExitStack() as stack:
            for part in self.parts.values():
                stack.callback(part.close)

    def _join_infos(self, infos: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Join the infos of all simulators. The rows of simulators that do not report a key are zero and masked."""
        joined: dict[str, Any] = {}
        for key in dict.fromkeys(key for info in infos for key in info):
            values: list[Any] = [info.get(key) for info in infos]
            known = next(value for value in values if value is not None)
            if isinstance(known, dict):
                joined[key] = self._join_infos([value or {} for value in values])
                continue
            absent = None if known.dtype == object else 0
            for index, part in enumerate(self.parts.values()):
                if values[index] is None:
                    values[index] = np.full((part.num_envs, *known.shape[1:]), absent, known.dtype)
            joined[key] = np.concatenate(values)
        return joined


def _check_same(parts: Mapping[str, RobotVectorEnv]) -> None:
    """Raise ConfigurationError if the spaces or timesteps of environments on several simulators differ."""
    (first, one), *others = parts.items()
    for name, other in others:
        ours, theirs = map(_bounds, (one, other))
        terms = [term for term in {**ours, **theirs} if ours.get(term) != theirs.get(term)]
        spaces = [
            f"{what}: {' '.join(str(mine).split())} and {' '.join(str(yours).split())}"
            for what, mine, yours in (
                ("action spaces", one.single_action_space, other.single_action_space),
                ("control timesteps [s]", one.control_timestep, other.control_timestep),
            )
            if mine != yours
        ]
        if terms or spaces:
            differences = [f"observation terms {', '.join(terms)}"] * bool(terms) + spaces
            raise ConfigurationError(
                f"num_envs: the environments on '{first}' and '{name}' differ in their {'; '.join(differences)}. Choose "
                "keywords with which they are the same on all simulators."
            )


def _bounds(env: RobotVectorEnv) -> dict[str, tuple[Any, ...]]:
    """Return what determines the observation space, by the name of the term."""
    return {
        name: (term.low.shape, term.low.tobytes(), term.high.tobytes(), term.key, term.dtype)
        for name, term in env.observations.terms.items()
    }


def _check_simulators(num_envs: Mapping[str, int]) -> None:
    if not num_envs:
        raise ParameterValueError("num_envs", num_envs, "a whole number, or a number for at least one simulator")
    for name, count in num_envs.items():
        if find_record(SimulatorRecord, name).is_paced:
            raise ParameterValueError("num_envs", dict(num_envs), f"simulators that are not paced, unlike '{name}'")
        whole_number(f"num_envs.{name}", count, 1)


def _join(batches: Sequence[Any]) -> Any:
    """Concatenate arrays, or for each key the arrays of dictionaries, along the first axis."""
    if isinstance(batches[0], dict):
        return {key: np.concatenate([batch[key] for batch in batches]) for key in batches[0]}
    return np.concatenate(batches)


def _take(batch: Any, rows: Any) -> Any:
    return {key: array[rows] for key, array in batch.items()} if isinstance(batch, dict) else batch[rows]

"""Noisy, delayed observations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.description import VECTORS, Observation
from frobs_core.sensing.observation import Observations
from frobs_core.sensing.randomization.draw import Draw, Setting
from frobs_core.sensing.randomization.targets import matches
from frobs_core.util.arrays import Mask
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource


class ObservedArray:
    """One array of an observation, with added noise and delay. Noise is added before the delay.

    Delayed observations are read from a history instead of being drawn again, so resetting some environments does not
    affect the others. The history contains ``depth`` measurements.
    """

    def __init__(self, key: str, space: gym.spaces.Box, num_envs: int, depth: int) -> None:
        self.key = key
        self.history = np.zeros((num_envs, depth, *space.shape), space.dtype)  # newest first
        self._low, self._high = (np.asarray(bound, np.float64) for bound in (space.low, space.high))
        self.noise: list[tuple[slice, Draw, slice]] = []  # columns, and the random numbers that are added to them
        self.delays: list[tuple[Any, Draw]] = []  # columns, and the number of steps by which they are delayed
        self._each = np.arange(num_envs)

    def begin(self, true: np.ndarray[Any, Any], mask: Mask) -> np.ndarray[Any, Any]:
        """Clear the history of the environments selected by ``mask``, and return all environments' observations."""
        self.history[mask] = self._measure(true, mask)[:, None]
        return self.observed()

    def step(self, true: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Store a new measurement and return the current observations."""
        history = self.history
        if history.shape[1] > 1:
            history[:, 1:] = history[:, :-1].copy()
        history[:, 0] = self._measure(true, slice(None))
        return self.observed()

    def observed(self) -> np.ndarray[Any, Any]:
        """Return the current observations, (num_envs, …), as a new array."""
        observed = self.history[:, 0].copy()
        for columns, draw in self.delays:
            late = self.history[self._each, draw.numbers.astype(np.intp)]
            observed[columns] = late[columns]
        return observed

    def _measure(self, true: np.ndarray[Any, Any], rows: Mask | slice) -> np.ndarray[Any, Any]:
        if not self.noise:
            return true[rows]
        measured = true[rows].astype(np.float64)
        for columns, draw, numbers in self.noise:
            measured[:, columns] += draw.numbers[rows, numbers]
        for columns, _, _ in self.noise:  # measurements are clipped to the observation's bounds
            np.clip(measured[:, columns], self._low[columns], self._high[columns], out=measured[:, columns])
        return measured.astype(true.dtype)


class ObservedArrays(Stateful):
    """The arrays of an observation to which the settings ``observation_noise`` or ``observation_delay`` apply."""

    def __init__(
        self,
        noise: Sequence[Setting],
        delays: Sequence[Setting],
        observations: Observations,
        num_envs: int,
        control_timestep: float,
    ) -> None:
        self._terms = observations.columns
        self._imperfect = {name for name, term in observations.terms.items() if term.imperfect}
        self._space, self._num_envs, self._timestep = observations.space, num_envs, control_timestep
        self._depth = 1 + max((int(setting.distribution.high) for setting in delays), default=0)
        self.arrays: dict[str, ObservedArray] = {}
        self.draws: list[Draw] = []
        self.constant: dict[str, tuple[Draw, slice]] = {}  # draws that stay constant within an episode
        for setting in noise:
            self._add_noise(setting)
        for setting in delays:
            self._add_delay(setting)
        self._changing = [draw for draw in self.draws if draw.changes_in_episode]

    def begin(self, rng: RandomSource, true: Observation, mask: Mask) -> Observation:
        """Begin episodes in the environments selected by ``mask``, and return the observations."""
        for draw in self.draws:
            draw.begin(rng, mask)
        return self._each(true, lambda array, values: array.begin(values, mask))

    def step(self, rng: RandomSource, true: Observation) -> Observation:
        """Advance by one step and return the observations."""
        for draw in self._changing:
            draw.step(rng)
        return self._each(true, ObservedArray.step)

    def _each(self, true: Observation, observe: Any) -> Observation:
        if not isinstance(true, dict):
            result: np.ndarray[Any, Any] = observe(self.arrays[VECTORS], true)
            return result
        return {key: observe(self.arrays[key], true[key]) if key in self.arrays else true[key] for key in true}

    def _named(self, setting: Setting) -> dict[str, tuple[str, slice]]:
        names = list(self._terms)
        found = matches(setting.targets or ("*",), names, f"observation term of {setting.place}")
        for i in found:
            if names[i] in self._imperfect:
                raise SettingError(
                    setting.place,
                    f"the observation term '{names[i]}' reads a sensor that already has noise, delay or other "
                    "imperfections; set noise and delay either for the sensor or in randomize.",
                )
        return {names[i]: self._terms[names[i]] for i in found}

    def _find_array(self, key: str, setting: Setting) -> tuple[ObservedArray, gym.spaces.Box]:
        space: Any = self._space[key] if isinstance(self._space, gym.spaces.Dict) else self._space
        if not isinstance(space, gym.spaces.Box):
            raise SettingError(
                setting.place, f"the observation '{key}' has the space {space}; noise and delays require a Box."
            )
        if key not in self.arrays:
            self.arrays[key] = ObservedArray(key, space, self._num_envs, self._depth)
        return self.arrays[key], space

    def _add_noise(self, setting: Setting) -> None:
        places, start = [], 0
        for name, (key, columns) in self._named(setting).items():
            array, space = self._find_array(key, setting)
            if len(space.shape) != 1 or space.dtype.kind != "f":
                raise SettingError(
                    setting.place, f"the observation '{key}' has the space {space}; noise requires a vector of floats."
                )
            numbers = slice(start, start := start + columns.stop - columns.start)
            places.append((name, array, columns, numbers))
        if setting.distribution.width not in (1, start):
            raise SettingError(
                setting.place,
                f"the setting has {setting.distribution.width} numbers for {start} columns; write one number, or one "
                "number for each column.",
            )
        draw = self._add_draw(setting, start)
        for name, array, columns, numbers in places:
            array.noise.append((columns, draw, numbers))
            if not draw.changes_in_episode:
                self.constant[f"{setting.stream}: {name}"] = draw, numbers

    def _add_delay(self, setting: Setting) -> None:
        draw = self._add_draw(setting)
        for key, columns in self._named(setting).values():
            self._find_array(key, setting)[0].delays.append(((slice(None), columns), draw))

    def _add_draw(self, setting: Setting, width: int = 1) -> Draw:
        self.draws.append(Draw(setting, self._num_envs, self._timestep, width))
        return self.draws[-1]

    def stored_arrays(self) -> Snapshot:
        return {key: array.history for key, array in self.arrays.items()}

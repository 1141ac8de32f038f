"""Applies an environment's randomization at the start of episodes and at each step."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from frobs_core.contracts import Simulation
from frobs_core.contracts.control import Control
from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.description import Observation
from frobs_core.sensing.observation import Observations
from frobs_core.sensing.randomization.delay import ActionDelay
from frobs_core.sensing.randomization.draw import Draw
from frobs_core.sensing.randomization.observation import ObservedArrays
from frobs_core.sensing.randomization.physics import PhysicalParameter
from frobs_core.sensing.randomization.settings import Settings, physical_parameters
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource


class Randomization(Stateful):
    """Randomization that makes environments and episodes differ from each other.

    An environment's draws depend on its seed, episode and step and on the setting's own stream, but not on other
    environments or settings.

    Args:
        settings: The user's settings.
        simulation: Simulation to write to.
        control: Controllers whose commands may be delayed.
        observations: Observation terms to which noise or delays may be added.
        control_timestep: [s]

    Attributes:
        settings: The user's settings, as plain dictionaries.

    Raises:
        UnknownNameError: A target does not exist.
        ConfigurationError: A setting cannot be used with this environment.
    """

    def __init__(
        self,
        settings: Settings,
        simulation: Simulation,
        control: Control,
        observations: Observations,
        control_timestep: float,
    ) -> None:
        self.settings: Mapping[str, Any] = settings.given
        self._all = np.ones(simulation.num_envs, np.bool_)
        self._physics = [
            PhysicalParameter(name, items, simulation, list(control.robots), control_timestep)
            for name in physical_parameters()
            if (items := settings.of(name))
        ]
        late = settings.of("action_delay")
        self._delay = ActionDelay(late[0], control, control_timestep) if late else None
        noise, delays = settings.of("observation_noise"), settings.of("observation_delay")
        self._observed: ObservedArrays | None = None
        self._observation_delays: list[Draw] = []
        if noise or delays:
            self._observed = ObservedArrays(noise, delays, observations, simulation.num_envs, control_timestep)
            self._observation_delays = self._observed.draws[len(noise) :]
        self._changing = [part for part in self._physics if any(draw.changes_in_episode for draw in part.draws)]

    def begin_physics(self, rng: RandomSource, mask: Mask | None) -> None:
        """Draw and write physical parameters for episodes that begin in the environments selected by ``mask``.

        Call this method before the simulation is reset.
        """
        rows = self._all if mask is None else mask
        for parameter in self._physics:
            parameter.begin(rng, rows)

    def begin(self, rng: RandomSource, observation: Observation, mask: Mask | None) -> Observation:
        """Draw delays and noise for episodes that begin in the environments selected by ``mask``.

        Call this method after the robot is placed, with the true observation of all environments, (num_envs, …). The
        result is the observation of all environments, which does not change for environments outside the mask.
        """
        rows = self._all if mask is None else mask
        if self._delay is not None:
            self._delay.begin(rng, rows)
        return observation if self._observed is None else self._observed.begin(rng, observation, rows)

    def act(self, rng: RandomSource, commands: list[Floats]) -> list[Floats]:
        """Update values that change within an episode, and return the commands that take effect now.

        Args:
            rng: Random source of the environment.
            commands: Command of each robot, (num_envs, dof) or (num_envs, decimation, dof).

        Returns:
            The commands, each with one of these shapes.
        """
        for parameter in self._changing:
            parameter.step(rng)
        return commands if self._delay is None else self._delay.apply(rng, commands)

    def observe(self, rng: RandomSource, observation: Observation) -> Observation:
        """Return the observations after a step, given the true observations."""
        return observation if self._observed is None else self._observed.step(rng, observation)

    @property
    def values(self) -> dict[str, Floats]:
        """Current values, (num_envs, …) each, by parameter and target, such as ``"mass/robot/link_1"`` [kg].

        Noise that is drawn at each step is omitted.
        """
        found: dict[str, Floats] = {}
        for parameter in self._physics:
            found |= parameter.values()
        if self._delay is not None:
            found["action_delay"] = self._delay.draw.numbers.copy()
        for draw in self._observation_delays:
            found[draw.stream.removesuffix("/0")] = draw.numbers.copy()
        if self._observed is not None:
            for name, (draw, numbers) in self._observed.constant.items():
                found[name] = draw.numbers[:, numbers].copy()
        return found

    @cached_property
    def observed_keys(self) -> frozenset[str]:
        """Keys of a dictionary observation that have noise or delay, or ``"observation"`` for a single array."""
        return frozenset(() if self._observed is None else self._observed.arrays)

    def stored_parts(self) -> Mapping[str, Stateful]:
        late = {"action_delay": self._delay, "measured": self._observed}
        draws = [draw for part in (*self._physics, *late.values()) if part is not None for draw in part.draws]
        parts = {**{parameter.name: parameter for parameter in self._physics}, **late}
        return {name: part for name, part in parts.items() if part is not None} | {draw.stream: draw for draw in draws}

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot.

        Raises:
            ConfigurationError: The snapshot is from an environment with different randomization settings.
        """
        mine = self.snapshot().keys()
        if mine != snapshot.keys():
            raise SettingError(
                "randomize",
                "the snapshot was taken with different randomization settings; differing entries: "
                f"{sorted(mine ^ snapshot.keys())[:4]}.",
            )
        super().restore(snapshot)

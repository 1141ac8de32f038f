"""Randomization of one physical parameter of the simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import CommandMode, Simulation
from frobs_core.contracts.stateful import Snapshot, Stateful
from frobs_core.sensing.randomization.draw import Draw, Setting
from frobs_core.sensing.randomization.settings import CAPABILITY
from frobs_core.sensing.randomization.targets import find_units, matches
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SettingError
from frobs_core.util.random import RandomSource

_LEAST = {"mass": 0.01, "size": 0.01}
"""Minimum mass and size of a body, as fractions of its nominal mass and size."""

_LIMITS = {"camera_fov": (1.0, 170.0), "texture": (0.0, 64.0), "distractors": (0.0, 8.999_999)}
"""Minimum and maximum of parameters that have both."""

_CHANGES: Mapping[str, Callable[[Floats, Floats], Floats]] = {
    "scale": np.multiply,
    "add": np.add,
    "set": lambda value, number: number,
}

_TRIPLES = ("color", "camera_position", "camera_rotation")
"""Parameters with three numbers for each target, which share its name."""

_VECTORS = ("stiffness", "damping", "joint_damping", "gravity", *_TRIPLES)
"""Parameters with an array for each target, (n, dof) or (n, 3). All others have one number for each target."""

_SIGNED = ("gravity", *_TRIPLES)
"""Parameters without a minimum. Simulators clip colors to [0, 1]."""

_OF_ROBOTS = ("mass", "stiffness", "damping", "joint_damping")
"""Parameters that are randomized only for robots by default."""

_WITHOUT_EFFECT: Mapping[tuple[str, CommandMode | None], str] = {
    ("stiffness", CommandMode.VELOCITY): "the controller commands velocities, for which the drives use only damping",
    ("stiffness", CommandMode.EFFORT): "the controller commands efforts, for which the drives do not use their gains",
    ("damping", CommandMode.EFFORT): "the controller commands efforts, for which the drives do not use their gains",
}


class PhysicalParameter(Stateful):
    """Randomization of one physical parameter for all objects that have this parameter.

    Settings are applied in order. The first setting changes the nominal value, and each subsequent setting changes the
    result of the previous one. By default, only links and joints of ``robots``, which have controllers, change.
    """

    def __init__(
        self,
        name: str,
        settings: Sequence[Setting],
        simulation: Simulation,
        robots: Sequence[str],
        control_timestep: float,
    ) -> None:
        self.name, self._simulation, self._robots = name, simulation, robots
        units = find_units(simulation, name)
        if not units:
            raise SettingError(
                settings[0].place, f"this environment has nothing whose {name} can be changed; remove this setting."
            )
        self.names = tuple(column for unit in units for column in unit.names)
        self.nominal: Floats = np.concatenate([unit.nominal for unit in units], axis=1)  # (num_envs, columns)
        self.current = self.nominal.copy()
        self._changes: list[tuple[str, npt.NDArray[np.intp], Draw]] = []
        for setting in settings:
            columns = np.array(self._columns(setting), np.intp)
            self._changes.append((setting.change, columns, self._draw(setting, columns, control_timestep)))
        self.touched = sorted({int(column) for _, columns, _ in self._changes for column in columns})
        self._writes: list[tuple[str, slice | int]] = []  # target, and the columns that contain its value
        start = 0
        for unit in units:
            stop = start + len(unit.names)
            if any(start <= column < stop for column in self.touched):
                self._writes.append((unit.target, slice(start, stop) if name in _VECTORS else start))
            start = stop
        self._limits = self._bounds(settings)
        self._changing = [draw for _, _, draw in self._changes if draw.changes_in_episode]

    @property
    def draws(self) -> list[Draw]:
        """All draws for this parameter."""
        return [draw for _, _, draw in self._changes]

    def begin(self, rng: RandomSource, mask: Mask) -> None:
        """Draw and write values for new episodes in the environments selected by ``mask``, (num_envs,) bool."""
        drawn = np.zeros_like(mask)
        for _, _, draw in self._changes:
            drawn |= draw.begin(rng, mask)
        if drawn.any():
            self._write(drawn)

    def step(self, rng: RandomSource) -> None:
        """Draw and write new values for the environments whose interval has elapsed."""
        for draw in self._changing:
            drawn = draw.step(rng)
            if drawn is not None:
                self._write(drawn)

    def values(self) -> Iterator[tuple[str, Floats]]:
        """Yield the name and the current values of each randomized quantity.

        The values have the shape (num_envs,), or (num_envs, 3) for gravity, colors and poses of cameras.
        """
        if self.name == "gravity":
            yield "gravity", self.current.copy()
            return
        width = 3 if self.name in _TRIPLES else 1
        for column in self.touched[::width]:
            values = self.current[:, column : column + width].copy()
            yield f"{self.name}/{self.names[column]}", values if width > 1 else values[:, 0]

    def stored_arrays(self) -> Snapshot:
        """Return the current values. The simulation's own snapshot restores the values in the engine."""
        return {"current": self.current}

    def _columns(self, setting: Setting) -> list[int]:
        if self.name == "gravity":
            return [0, 1, 2]
        patterns = setting.targets or ([f"{robot}/*" for robot in self._robots] if self.name in _OF_ROBOTS else ["*"])
        found = matches(patterns, self.names, f"target of {setting.place}")
        modes = {
            f"{name}/{joint}": mode
            for name, robot in self._simulation.robots.items()
            for joint, mode in zip(robot.joint_names, robot.command_modes, strict=True)
        }
        reasons = [_WITHOUT_EFFECT.get((self.name, modes.get(self.names[column]))) for column in found]
        if all(reasons):
            raise SettingError(
                setting.place,
                f"this setting has no effect, because {reasons[0]}; remove the setting, or choose another controller.",
            )
        if setting.change == "scale" and not self._changes and not self.nominal[:, found].any():
            raise SettingError(
                setting.place,
                f"the nominal {self.name} of {', '.join(self.names[c] for c in found)} is 0, so "
                "scale has no effect; use add or set.",
            )
        return found

    def _draw(self, setting: Setting, columns: npt.NDArray[np.intp], control_timestep: float) -> Draw:
        vector = self.name == "gravity"
        shared = setting.shared or (vector and setting.change == "scale")
        width = 1 if shared else len(columns)
        given = setting.distribution.width
        if given != 1 and (not vector or given != width):
            one = "one number, or (except for a scale) three numbers for x, y and z" if vector else "one number"
            raise SettingError(setting.place, f"a bound has {given} numbers; for each bound, write {one}.")
        return Draw(setting, len(self.nominal), control_timestep, width)

    def _write(self, rows: Mask) -> None:
        value = self.nominal[rows]
        for change, columns, draw in self._changes:
            value[:, columns] = _CHANGES[change](value[:, columns], draw.numbers[rows])
        if self._limits is not None:
            low, high = self._limits
            np.clip(value, low[rows], high[rows], out=value)
        self.current[rows] = value
        mask = None if rows.all() else rows
        for target, its in self._writes:
            self._simulation.write_parameter(self.name, target, value[:, its], mask)

    def _bounds(self, settings: Sequence[Setting]) -> tuple[Floats, Floats] | None:
        """Return the limits of the values, (num_envs, columns) each, and reject settings that could exceed them.

        Draws from an unbounded distribution are clipped to the limits instead.
        """
        if self.name in _SIGNED or self.name not in CAPABILITY:
            return None
        lowest, highest = _LIMITS.get(self.name, (0.0, np.inf))
        least = np.maximum(self.nominal * _LEAST.get(self.name, 0.0), lowest)
        most = np.full_like(least, highest)
        for end, sign, limits in (("low", 1.0, least), ("high", -1.0, most)):
            value = self.nominal.copy()
            for setting, (change, columns, _) in zip(settings, self._changes, strict=True):
                number = getattr(setting.distribution, end)
                # Unbounded distributions pass this check, because their draws are later clipped.
                changed = _CHANGES[change](value[:, columns], number)
                value[:, columns] = np.where(np.isinf(number), sign * np.inf, changed)
            wrong = [column for column in self.touched if (sign * value < sign * limits)[:, column].any()]
            if wrong:
                column = wrong[0]
                limit = f"{limits[0, column]:.7g}"
                if self.name in _LEAST:
                    limit = f"{_LEAST[self.name]:.0%} of the nominal {self.name}"
                raise SettingError(
                    settings[-1].place,
                    f"the {self.name} of {self.names[column]}, whose nominal value is {self.nominal[0, column]:.6g}, "
                    f"could become {value[0, column]:.6g}, which is {'below' if end == 'low' else 'above'} {limit}; "
                    "narrow the range.",
                )
        return least, most

"""Rules for commands to a robot: what may be sent, and when the robot must hold.

Software limits do not replace the robot's emergency stop. This module does not import the core, so it also runs on
Python 3.10.
"""

from __future__ import annotations

import json
import logging
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from frobs_ros2.errors import SettingsError

Array = np.ndarray[Any, Any]

_log = logging.getLogger("frobs")
_JUMP = 0.1  # [rad or m] measured motion that is always accepted, for noise
_ROUNDING = 1e-7  # [rad, m, rad/s, …] difference of commands that is not reported
_STOP_TIME = 0.1  # [s] time in which a joint must be able to stop before its position limit

REPEATED = "a measurement was repeated"
"""Reason for a measurement with the stamp of the one before."""

RULES = {
    "finite": "a command that is not finite is not sent; the robot holds",
    "position": "commands are clipped to the position limits; velocities toward a limit are reduced near it",
    "velocity": "a joint's command changes by at most its velocity limit times the control timestep",
    "acceleration": "the commanded velocity changes by at most the acceleration limit times the control timestep, "
    "except at a position limit",
    "effort": "efforts are clipped to the effort limits",
    "workspace": "a command that moves the tool out of the box is not sent; the robot holds",
    "slow start": "the velocity limit grows from 10 % to its full value after the start and after each hold",
    "dead-man": "without a fresh signal of the dead-man switch the robot holds",
    "measurement": "measurements that are old, ahead of the clock, repeated, out of order, not finite or jump are not used; the "
    "robot holds",
}
"""The rules, by the name under which changed commands are logged."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a robot.

    Attributes:
        joint_names: Names of the joints, in the order of all arrays.
        lower: Lower position limits, (dof,) [rad or m].
        upper: Upper position limits, (dof,) [rad or m].
        velocity: Velocity limits, (dof,) [rad/s or m/s].
        effort: Effort limits, (dof,) [N·m or N].
        acceleration: Acceleration limit of all joints [rad/s² or m/s²], or None for no limit.
        workspace: Corners of the box in which the tool may be, (2, 3) [m], or None for no limit.
        speed: Fraction of the velocity limits that may be used, in (0, 1].
        slow_start: Time in which the velocity limit grows to its full value [s].
        max_age: Age above which a measurement is not used [s].
        deadman: Whether a dead-man switch is required.
        deadman_age: Age above which the signal of the switch counts as released [s].
    """

    joint_names: Sequence[str]
    lower: Array
    upper: Array
    velocity: Array
    effort: Array
    acceleration: float | None = None
    workspace: Array | None = None
    speed: float = 1.0
    slow_start: float = 0.0
    max_age: float = 0.2
    deadman: bool = False
    deadman_age: float = 0.5

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            SettingsError: A number is out of range, or the corners of the workspace are swapped.
        """
        if self.acceleration is not None and not 0.0 < self.acceleration < np.inf:
            raise SettingsError(f"acceleration is {self.acceleration:g}; it must be a finite number above 0.")
        for name, value in (("slow_start", self.slow_start), ("max_age", self.max_age)):
            if not value >= 0.0:
                raise SettingsError(f"{name} is {value:g}; it must be 0 or more.")
        if self.workspace is not None and not (self.workspace[0] < self.workspace[1]).all():
            raise SettingsError(
                "workspace: each number of the lower corner must be less than that of the upper corner."
            )


@dataclass(frozen=True)
class Change:
    """A command that was changed.

    Attributes:
        time: Time of the command [s].
        rule: Name of the rule; see :data:`RULES`.
        reason: What was wrong.
        asked: The command that was asked for, (dof,). Values that are not finite are None.
        sent: The command that was sent instead, (dof,).
    """

    time: float
    rule: str
    reason: str
    asked: list[float | None]
    sent: list[float]


@dataclass
class SafetyFilter:
    """Applies the rules to the commands of one robot.

    Args:
        limits: Limits of the robot.
        timestep: Time between two commands [s].
        tool: Function that returns the position of the tool (3,) [m] for joint positions (dof,). It is required if
            there is a workspace.
        log: File to which each change is appended as a line of JSON, or None. If it can no longer be written, for example
            because the disk is full, a warning is logged, and the rules continue without it.

    Attributes:
        changes: The last changes.
        counts: Number of changes by rule.
        held: Reason why the robot holds, or an empty text.

    Raises:
        SettingsError: The file of the log cannot be written.
    """

    limits: Limits
    timestep: float
    tool: Callable[[Array], Array] | None = None
    log: Path | None = None
    changes: deque[Change] = field(default_factory=lambda: deque(maxlen=1_000))
    counts: Counter[str] = field(default_factory=Counter)
    held: str = ""
    _positions: Array | None = None
    _stamp: float = -np.inf
    _moved: Array | None = None
    _last: Array | None = None
    _last_velocity: Array | None = None
    _mode: str = ""
    _began: float = 0.0
    _pressed: float = -np.inf

    def __post_init__(self) -> None:
        """Check that the log can be written."""
        if self.log is not None:
            try:
                self.log.open("a").close()
            except OSError as error:
                raise SettingsError(
                    f"log: {self.log} cannot be written: {error.strerror}; choose another file."
                ) from error

    def start(self, positions: Array, now: float, stamp: float | None = None) -> None:
        """Begin at measured positions, for example at the start of an episode.

        Args:
            positions: (dof,) [rad or m]
            now: Current time [s].
            stamp: Time of the measurement [s], or None to accept any next one.
        """
        self._positions = self._last = np.array(positions, float)
        self._last_velocity = np.zeros(len(self._positions))
        self._stamp = -np.inf if stamp is None else stamp
        self._began, self._mode, self.held = now, "", ""

    def press(self, pressed: bool, now: float) -> None:
        """Receive the signal of the dead-man switch.

        Args:
            pressed: Whether the switch is pressed.
            now: Current time [s].
        """
        self._pressed = now if pressed else -np.inf

    def measure(self, stamp: float, positions: Array, velocities: Array, now: float) -> str:
        """Check a measurement.

        Args:
            stamp: Time of the measurement [s].
            positions: (dof,) [rad or m]
            velocities: (dof,) [rad/s or m/s]
            now: Current time on the same clock [s].

        Returns:
            The reason why the measurement must not be used, or an empty text.
        """
        positions, velocities = np.asarray(positions, float), np.asarray(velocities, float)
        if positions.shape != (len(self.limits.joint_names),) or not np.isfinite([*positions, *velocities]).all():
            return "a measurement has the wrong size or is not finite"
        if stamp == self._stamp:
            return REPEATED
        if stamp < self._stamp:
            return "a measurement is older than the one before"
        if now - stamp > self.limits.max_age:
            return f"a measurement is {now - stamp:.2g} s old"
        if stamp - now > self.limits.max_age:  # it would seem fresh for so long after the last one
            return f"a measurement is {stamp - now:.2g} s ahead of the clock"
        if self._positions is not None and np.isfinite(self._stamp):
            reach = _JUMP + 1.5 * self.limits.velocity * (stamp - self._stamp)
            moved = np.abs(positions - self._positions)
            if (moved > reach).any():
                self._stamp = stamp
                i = int((moved - reach).argmax())
                return f"joint '{self.limits.joint_names[i]}' jumped by {moved[i]:.2g}"
        self._positions, self._stamp = positions, stamp
        return ""

    def age(self, now: float) -> float:
        """Return the age of the last measurement that was used [s].

        Args:
            now: Current time [s].
        """
        return now - self._stamp

    def command(self, mode: str, values: Array, now: float) -> Array:
        """Return the command that may be sent, (dof,), in the unit of the mode.

        Args:
            mode: ``"position"``, ``"velocity"`` or ``"effort"``.
            values: Command, (dof,).
            now: Current time [s].
        """
        assert self._positions is not None, "start() comes first"
        asked = np.array(values, float)
        self._use(mode)
        if self.limits.deadman and now - self._pressed > self.limits.deadman_age:
            return self._hold(asked, "dead-man", "the dead-man switch is not pressed", now)
        if asked.shape != self._positions.shape or not np.isfinite(asked).all():
            return self._hold(asked, "finite", "the command is not finite", now)
        if self.held:
            self._began, self.held = now, ""
        if mode == "effort":
            sent = self._note("effort", asked, np.clip(asked, -self.limits.effort, self.limits.effort), now)
        else:
            assert self._last is not None
            fastest = self._fastest(now)
            rate = self._position_rate(asked, now) if mode == "position" else asked
            limited = np.clip(rate, -fastest, fastest)
            rule = "slow start" if now - self._began < self.limits.slow_start else "velocity"
            if mode == "velocity":
                asked = limited = self._note(rule, rate, limited, now)
                sent = self._last_velocity = self._near_limits(self._accelerate(limited, now), now)
                moved = self._positions + sent * self.timestep
            else:
                sent = self._last + limited * self.timestep
                if _differ(rate, limited):
                    sent = self._note(rule, asked, sent, now)
                sent = self._last + self._accelerate((sent - self._last) / self.timestep, now) * self.timestep
                low, high = np.minimum(self.limits.lower, self._last), np.maximum(self.limits.upper, self._last)
                sent = self._note("position", sent, np.clip(sent, low, high), now)  # wins over the acceleration limit
                self._last_velocity, moved = (sent - self._last) / self.timestep, sent
            if self._leaves(moved):
                return self._hold(asked, "workspace", "the tool would leave the workspace", now)
        self._last = sent
        return sent

    def hold(self, mode: str, reason: str, now: float) -> Array:
        """Return the command that makes the robot hold, (dof,), and log the reason once.

        Args:
            mode: Mode of the commands.
            reason: Why the robot must hold.
            now: Current time [s].
        """
        self._use(mode)
        assert self._last is not None
        return self._hold(self._last, "measurement", reason, now)

    def _use(self, mode: str) -> None:
        """Continue from the measured positions, or from rest, if the mode of the commands changes."""
        assert self._positions is not None, "start() comes first"
        if mode != self._mode:
            self._mode, still = mode, np.zeros(len(self._positions))
            self._last_velocity = still
            self._last = self._positions.copy() if mode == "position" else still

    def _hold(self, asked: Array, rule: str, reason: str, now: float) -> Array:
        assert self._positions is not None
        if self._mode == "position":
            # A position command far from the joint would still move it, so the joint stops where it is.
            near = self.limits.velocity * self.timestep
            assert self._last is not None
            held = np.clip(self._last, self._positions - near, self._positions + near)
        else:
            held = np.zeros(len(self._positions))
        if not self.held:
            self._change(rule, reason, asked, held, now)
        self.held, self._last, self._last_velocity = reason, held, np.zeros(len(held))
        return held

    def _fastest(self, now: float) -> Array:
        """Return the velocity limit that applies now, (dof,) [rad/s or m/s]."""
        grown = 1.0 if not self.limits.slow_start else min(1.0, 0.1 + (now - self._began) / self.limits.slow_start)
        return self.limits.velocity * (self.limits.speed * grown + 1e-9)

    def _position_rate(self, asked: Array, now: float) -> Array:
        inside = self._note("position", asked, np.clip(asked, self.limits.lower, self.limits.upper), now)
        return np.asarray((inside - self._last) / self.timestep)

    def _near_limits(self, velocity: Array, now: float) -> Array:
        assert self._positions is not None
        time = max(self.timestep, _STOP_TIME)
        low = np.minimum(0.0, (self.limits.lower - self._positions) / time)
        high = np.maximum(0.0, (self.limits.upper - self._positions) / time)
        return self._note("position", velocity, np.clip(velocity, low, high), now)

    def _accelerate(self, velocity: Array, now: float) -> Array:
        sent = velocity
        if self.limits.acceleration is not None:
            assert self._last_velocity is not None
            change = self.limits.acceleration * self.timestep + 1e-9
            limited = np.clip(velocity, self._last_velocity - change, self._last_velocity + change)
            sent = self._note("acceleration", velocity, limited, now)
        self._last_velocity = sent
        return sent

    def _leaves(self, positions: Array) -> bool:
        if self.limits.workspace is None or self.tool is None:
            return False
        low, high = self.limits.workspace
        tool = self.tool(positions)
        return bool((tool < low).any() or (tool > high).any())

    def _note(self, rule: str, asked: Array, sent: Array, now: float) -> Array:
        if _differ(asked, sent):
            i = int(np.abs(asked - sent).argmax())
            reason = f"joint '{self.limits.joint_names[i]}': {asked[i]:.4g} became {sent[i]:.4g}"
            self._change(rule, reason, asked, sent, now)
        return sent

    def _change(self, rule: str, reason: str, asked: Array, sent: Array, now: float) -> None:
        requested = [value if np.isfinite(value) else None for value in np.asarray(asked, float).tolist()]
        change = Change(now, rule, reason, requested, sent.tolist())
        self.changes.append(change)
        self.counts[rule] += 1
        if self.log is not None:
            try:
                with self.log.open("a", encoding="utf-8") as file:
                    file.write(f"{json.dumps(asdict(change), allow_nan=False)}\n")
            except OSError as error:  # it must not prevent the command from being sent
                _log.warning(
                    "%s cannot be written: %s; changed commands are no longer logged.", self.log, error.strerror
                )
                self.log = None


def _differ(asked: Array, sent: Array) -> bool:
    """Return whether two commands differ by more than rounding, in a fraction of the time of ``np.allclose``."""
    return bool(np.abs(asked - sent).max(initial=0.0) > _ROUNDING)

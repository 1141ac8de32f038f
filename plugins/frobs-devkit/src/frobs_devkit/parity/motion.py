"""Records joint motions, and compares two recordings sample by sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement
from frobs_core.models import home_positions
from frobs_core.util.arrays import Floats
from frobs_devkit.parity.result import Line
from frobs_devkit.parity.under_test import Subject

_EDGE = 0.02  # fraction of a joint's range near each limit that free motion must not enter
_INSIDE = 0.1  # minimum distance between the start and the joint limits, as a fraction of the joint's range


@dataclass(frozen=True)
class Motion:
    """Recorded motion of the joints. The first sample is taken after one sampling period."""

    times: Floats  # since the start, (samples,) [s]
    positions: Floats  # (samples, dof) [rad or m]
    velocities: Floats  # (samples, dof) [rad/s or m/s]
    efforts: Floats  # (samples, dof) [N·m or N]

    def until(self, samples: int) -> Motion:
        """Return the first ``samples`` samples."""
        return Motion(*(array[:samples] for array in (self.times, self.positions, self.velocities, self.efforts)))


def position_bounds(subject: Subject) -> tuple[Floats, Floats]:
    """Return the lower and upper positions between which joint limits have no effect, (dof,) each [rad or m]."""
    return _limits(subject, _EDGE)


def start_positions(subject: Subject) -> Floats:
    """Return the home position (dof,) [rad or m], moved slightly inward where a joint is at its limit."""
    model = subject.placement.model
    inside: Floats = np.clip(home_positions(model, subject.placement.robot.home), *_limits(subject, _INSIDE))
    return inside


def _limits(subject: Subject, share: float) -> tuple[Floats, Floats]:
    """Return the position limits, (dof,) each [rad or m], moved inward by a fraction of each finite range."""
    lower, upper = np.array([(j.limits.lower, j.limits.upper) for j in subject.placement.model.actuated_joints]).T
    margin = np.where(np.isfinite(upper - lower), share * (upper - lower), 0.0)
    return lower + margin, upper - margin


def record(subject: Subject, placement: Placement, commands: Floats, duration: float, period: float) -> list[Motion]:
    """Record the motion for each command sequence, starting from :func:`start_positions`.

    The ``commands`` (motions, phases, dof) have phases of the same duration. Position commands are relative to the
    start positions. The sampling ``period`` [s] must be a multiple of the subject's ``physics_timestep``.
    """
    steps, samples = max(1, round(period / subject.physics_timestep)), round(duration / period)
    motions = []
    with subject.simulate(placement) as (simulation, robot):
        start = start_positions(subject)[None]
        origin = start if placement.command_mode is CommandMode.POSITION else 0.0
        for command in commands:
            simulation.reset()
            if (start != robot.home).any():
                robot.write_joint_state(start)
            phases, begun = len(command), -1
            rows = np.empty((3, samples, robot.dof))
            for k in range(samples):
                if k * phases // samples != begun:
                    begun = k * phases // samples
                    robot.command(origin + command[begun : begun + 1])
                simulation.step(steps)
                rows[0, k], rows[1, k] = robot.joint_positions[0], robot.joint_velocities[0]
                rows[2, k] = robot.joint_efforts[0]
            motions.append(Motion(period * np.arange(1.0, samples + 1.0), *rows))
    return motions


def differences(reference: Sequence[Motion], other: Sequence[Motion]) -> Floats:
    """Return the absolute joint position differences of two recordings, (motions, samples, dof)."""
    return np.stack([np.abs(a.positions - b.positions) for a, b in zip(reference, other, strict=True)])


def apart(found: Floats, expected: Floats, samples: int) -> Floats:
    """Return the distance (n,) between each recorded value (n,) and the range of the expected values (n,) near it.

    The range includes ``samples`` expected values before and after each sample, so 0 compares single values.
    """
    around = np.lib.stride_tricks.sliding_window_view(np.pad(expected, samples, mode="edge"), 2 * samples + 1)
    error: Floats = np.maximum(np.maximum(around.min(axis=-1) - found, found - around.max(axis=-1)), 0.0)
    return error


def worst_joint(errors: Floats, names: Sequence[str], times: Floats) -> str:
    """Return the joint and time of the largest error, such as ``"joint elbow at 0.214 s"``.

    The shape of ``errors`` is (…, samples, dof).
    """
    place = np.unravel_index(int(np.argmax(np.nan_to_num(errors, nan=np.inf))), errors.shape)
    return f"joint {names[int(place[-1])]} at {times[int(place[-2])]:.3f} s"


def error_line(label: str, errors: Floats, times: Floats, number: int) -> Line:
    """Return a line that shows the largest error at each sample."""
    return Line(label, times, errors.max(axis=-1).reshape(-1, len(times)).max(axis=0), number, 0)

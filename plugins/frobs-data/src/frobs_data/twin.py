"""Identifies how a recorded robot differs from its simulation: delay, jitter, noise and tracking of its drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import CapabilityError, RunError
from frobs_core.util.validation import whole_number
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.mirror import GOAL_TERMS, MEASURED_TERMS, Mirror
from frobs_data.recorded_features import ACTION
from frobs_data.replaying import read_settings
from frobs_train.environments import is_paced, make_env, make_vector_env

GAINS = ("stiffness", "damping")
_POSITIONS = "joint_positions"
_USED = {CommandMode.POSITION: GAINS, CommandMode.VELOCITY: ("damping",), CommandMode.EFFORT: ()}
_SKIPPED = 5  # steps at the start of an episode, in which the unknown initial velocity matters
_LEAST_MOTION = 0.02  # [rad or m] a joint that moves less is not identified
_ROUNDS = 8
_STEP = 0.05  # of the logarithm of a gain, for the derivatives
_COARSE = math.log(2.0)  # of the damping, for the first delays
_LONGEST, _FARTHEST = 0.7, math.log(5.0)  # limits of a change, and of the result
_LEAST_JITTER = 0.2  # [control steps]
_WITHOUT_NOISE = frozenset(("goal", "desired_goal", "joint_efforts"))
_PRIOR = 0.7  # standard deviation of the logarithm of a gain before the measurement
_UNCERTAIN_GAIN, _UNCERTAIN_DELAY = 0.35, 0.25  # standard errors above which something is not identified
_LEAST_NOISE = 1e-4  # less is neglected
_WHOLE = 0.25  # distance from a whole number of steps that is neglected


@dataclass(frozen=True)
class Estimate:
    """A number and its standard error.

    Attributes:
        value: The number.
        error: Its standard error.
    """

    value: float
    error: float


@dataclass(frozen=True, kw_only=True)
class Twin:
    """Differences between a recorded robot and its simulation.

    Attributes:
        control_timestep: [s]
        delays: Time from an action to its measured effect in each episode [control steps]. Empty if it could not be
            identified.
        jitter: Standard deviation of the delay within an episode [control steps]. 0 if it is not significant.
        noise: Standard deviation of the noise of each observation term.
        gains: Factor of the drives' stiffness and damping, by ``"stiffness/joint"``.
        tracking_error: Root mean square of the difference between measured and simulated positions [rad or m].
        problems: What could not be identified, and why.
    """

    control_timestep: float
    delays: tuple[Estimate, ...]
    jitter: float
    noise: Mapping[str, float]
    gains: Mapping[str, Estimate]
    tracking_error: float
    problems: tuple[str, ...]

    def block(self) -> dict[str, Any]:
        """Return settings for ``randomize``. Gains vary by two standard errors.

        The recording does not show which part of the delay belongs to the measurement. Only the part that changes
        within an episode becomes a delay of the observation.
        """
        found: dict[str, Any] = {}
        late = max(1, round(math.sqrt(1.0 + 12.0 * self.jitter**2) - 1.0)) if self.jitter else 0
        if self.delays:
            least, most = (max(0.0, end(each.value for each in self.delays) - 0.5 * late) for end in (min, max))
            low, high = math.floor(least + _WHOLE), math.ceil(most - _WHOLE)
            if high > 0:
                found["action_delay"] = {"steps": high if low >= high else [low, high]}
        if late:
            found["observation_delay"] = {"steps": [0, late], "when": "step"}
        for name, estimate in self.gains.items():
            gain, joint = name.split("/")
            ends = [round(estimate.value * math.exp(sign * 2.0 * estimate.error), 4) for sign in (-1, 1)]
            found.setdefault(gain, []).append({"target": joint, "scale": ends})
        if self.noise:
            found["observation_noise"] = {name: {"normal": float(f"{std:.3g}")} for name, std in self.noise.items()}
        return found


def identify(
    folder: Path | str,
    *,
    episodes: int = 10,
    max_delay: int = 10,
    simulator: str | None = None,
    trust: bool = False,
    on_progress: Callable[[str], object] | None = None,
) -> Twin:
    """Identify delay, jitter, noise and tracking from the commands and the measured joint positions of a data set.

    The recorded commands are simulated with several delays and gains of the drives. A least-squares fit of the measured
    positions, from which the mean of each episode is subtracted, gives the delay and the gains. The noise is what
    changes from one step to the next in the remaining difference; what grows with the speed is jitter. Contacts are not
    reproduced, so record motions in free space.

    Args:
        folder: Data set that ``frobs record`` or ``frobs data import`` has written.
        episodes: Number of episodes to use, from the first.
        max_delay: Longest delay [control steps].
        simulator: Name of the simulator. None uses that of the recording, or, if it is a real robot, that of the
            environment.
        trust: Whether to accept settings that name files or modules.
        on_progress: Called with a text while episodes are simulated.

    Raises:
        DataError: The data set contains no joint positions, or is too short.
        RunError: The environment has several robots, a mobile one, or a controller that runs at the physics rate.
        UntrustedFileError: The settings name files or modules, and ``trust`` is not set.
    """
    whole_number("episodes", episodes, 1)
    whole_number("max_delay", max_delay, 1)
    dataset, report = Dataset(folder), on_progress or (lambda text: None)
    environment, kwargs, recorded = read_settings(dataset, trust)
    is_other = simulator is not None or is_paced(recorded)
    left_out = ("randomize", *(("simulator", "simulator_kwargs") if is_other else ()))
    kwargs = {name: value for name, value in kwargs.items() if name not in left_out}
    kwargs |= {} if simulator is None else {"simulator": simulator}
    with ExitStack() as stack:
        env = make_env(environment, kwargs)
        stack.callback(env.close)
        mirror = Mirror(env)
        if mirror.env.control.physics_rate:
            raise RunError("the commands of a controller that runs at the physics rate are not in the data set.")
        recordings = [_Recording(dataset, each.index, mirror) for each in dataset.episodes[:episodes]]
        recordings = [each for each in recordings if len(each.measured) > 2 * _SKIPPED + max_delay]
        if not recordings:
            reason = f"no episode has more than {2 * _SKIPPED + max_delay} frames"
            raise DataError(folder, f"{reason}; record longer episodes, or use a smaller --max-delay.")
        batch = make_vector_env(environment, max(max_delay + 1, 3 + len(GAINS) * len(mirror.arm)), kwargs)
        stack.callback(batch.close)
        fit = _Fit(_Simulated(batch.unwrapped, recordings, max_delay), recordings, mirror, max_delay)
        fit.run(report)
        predicted = fit.predict()
        noise, jitter = _noise(mirror, recordings, predicted, fit.moving)
        errors = [
            (states[_SKIPPED:, 0] - each.measured[1 + _SKIPPED :])
            for states, each in zip(predicted, recordings, strict=True)
        ]
        return Twin(
            control_timestep=mirror.env.control_timestep,
            delays=fit.known_delays(),
            jitter=jitter if fit.known_delays() else 0.0,
            noise=noise,
            gains=fit.known_gains(),
            tracking_error=math.sqrt(np.mean([np.mean((each - each.mean(axis=0)) ** 2) for each in errors])),
            problems=tuple(fit.problems()),
        )


class _Recording:
    """Measured joints and commands of one episode."""

    def __init__(self, dataset: Dataset, index: int, mirror: Mirror) -> None:
        if mirror.sizes.get(_POSITIONS) != len(mirror.joint_names):
            advice = f"record it with --set 'environment_kwargs.observations.{_POSITIONS}={{type: {_POSITIONS}}}'"
            raise DataError(dataset.folder, f"the environment does not observe the positions of all joints; {advice}.")
        names = [name for name in mirror.features if not mirror.features[name].is_video]
        columns = dataset.columns([*names, ACTION], [index])
        self.terms: dict[str, Floats] = {}
        for feature in names:
            self.terms |= mirror.split(feature, np.asarray(columns[feature], np.float64))
        self.measured = self.terms[_POSITIONS]
        goals = self.terms.get("goal", self.terms.get("desired_goal"))
        is_fixed = goals is not None and goals.shape[1] == 3 and not np.ptp(goals, axis=0).any()
        self.goal = goals[0] if goals is not None and is_fixed and mirror.has_goal else None
        velocities = self.terms.get("joint_velocities", np.zeros_like(self.measured))
        self.joints = np.stack([self.measured, velocities, np.zeros_like(self.measured)], axis=1)  # (n, 3, dof)
        mirror.begin(self.joints[0], self.goal)
        self.commands = np.empty_like(self.measured)
        for i, action in enumerate(columns[ACTION]):
            mirror.place(self.joints[i], None)
            self.commands[i] = np.reshape(mirror.env.control.commands(np.asarray(action[None], float))[0], (-1,))[
                -len(mirror.joint_names) :
            ]


class _Simulated:
    """Simulates recorded commands with delays and gains for each row of a vector environment."""

    def __init__(self, env: Any, recordings: Sequence[_Recording], max_delay: int) -> None:
        self._env, self._recordings, self._max_delay = env, recordings, max_delay
        self._robot, self._name = env.robot, next(iter(env.control.robots))
        env.reset(seed=0)
        self.nominal: dict[str, Floats] = {}
        for gain in GAINS:
            with suppress(CapabilityError):  # of the simulator: then only delay and noise are identified
                self.nominal[gain] = np.array(env.simulation.parameter(gain, self._name), float)

    def run(self, gains: Floats, delays: Floats) -> list[Floats]:
        """Return positions and velocities of each episode, (rows, n − 1, 2, dof), beginning after the first step.

        Args:
            gains: Factors of stiffness and damping of each row, (rows, 2, dof).
            delays: Delay of each episode and row [control steps], (episodes, rows) of whole numbers.
        """
        env, robot, rows = self._env, self._robot, len(gains)
        for number, (gain, nominal) in enumerate(self.nominal.items()):
            factors = np.ones_like(nominal)
            factors[:rows] = gains[:, number]
            env.simulation.write_parameter(gain, self._name, nominal * factors)
        found = []
        for each, late in zip(self._recordings, delays, strict=True):
            env.simulation.reset(None)
            start = np.repeat(each.joints[:1], env.num_envs, axis=0)
            robot.write_joint_state(start[:, 0], start[:, 1])
            held = np.repeat(robot.holding_command(start[:1, 0]), self._max_delay, axis=0)
            commands, states = np.concatenate([held, each.commands]), []
            first = np.full(env.num_envs, self._max_delay)
            first[:rows] -= late.astype(int)
            for frame in range(len(each.measured) - 1):
                robot.command(commands[frame + first])
                env.simulation.step(env.decimation)
                states.append(np.stack([robot.joint_positions[:rows], robot.joint_velocities[:rows]], axis=1))
            found.append(np.stack(states, axis=1))
        return found


class _Fit:
    """Fits the delay of each episode and the gains of each joint to the measured positions, by Gauss–Newton steps.

    The parameters of a joint are the logarithms of a factor of both gains, and of another factor of the damping alone.
    The second determines how far the joint lags behind, which is measured more exactly than the first.
    """

    def __init__(self, simulated: _Simulated, recordings: Sequence[_Recording], mirror: Mirror, max_delay: int) -> None:
        self._simulated, self._max_delay, self._names = simulated, max_delay, mirror.joint_names
        modes, arm = mirror.robot.command_modes, mirror.arm
        moved = np.max(
            [np.minimum(np.ptp(each.commands, axis=0), np.ptp(each.measured, axis=0)) for each in recordings], 0
        )
        self.moving = [i for i in arm if moved[i] >= _LEAST_MOTION]
        self._still = [
            f"{self._names[i]}: it moves by less than {_LEAST_MOTION} rad or m" for i in set(arm) - {*self.moving}
        ]
        self._parameters = [
            (number, i)
            for number, gain in enumerate(GAINS)
            for i in self.moving
            if gain in simulated.nominal and gain in _USED[modes[i]] and simulated.nominal[gain][0, i] > 0.0
        ]
        self._logs, self._delays = np.zeros(len(self._parameters)), np.zeros(len(recordings))
        size = len(self._logs) + len(self._delays)
        self._covariance = np.diag(np.full(size, np.inf))
        self._measured = [self._centered(each.measured[None, 1:])[0] for each in recordings]

    def run(self, report: Callable[[str], object]) -> None:
        """Fit in several rounds: the gains change which delay fits best, and the reverse."""
        if not self.moving:
            return
        report("simulating with different delays")
        best = math.inf
        for log in (0.0, -_COARSE, _COARSE) if self._parameters else (0.0,):
            logs = np.array([log * number for number, _ in self._parameters])
            errors = self._errors(self._scan(logs))
            if (total := errors.min(axis=1).sum()) < best:
                best, self._logs, self._delays = total, logs, errors.argmin(axis=1).astype(float)
        kept: tuple[float, Floats, Floats] | None = None
        for number in range(_ROUNDS):
            report(f"fitting: round {number + 1} of {_ROUNDS}")
            error, logs, delays, covariance = self._improve()
            if kept is not None and error > kept[0]:  # the step was too long
                self._logs, self._delays = 0.5 * (self._logs + kept[1]), 0.5 * (self._delays + kept[2])
                continue
            kept, self._covariance = (error, self._logs, self._delays), covariance
            self._logs, self._delays = logs, delays
        assert kept is not None  # the first round is always kept
        _, self._logs, self._delays = kept

    def _improve(self) -> tuple[float, Floats, Floats, Floats]:
        """Return the squared error, the next logarithms and delays, and the covariance of the current ones."""
        count = len(self._logs)
        middle = np.clip(np.round(self._delays), 1, self._max_delay - 1)
        moved = np.concatenate([np.zeros((3, count)), _STEP * np.eye(count)])
        around = np.array([-1, 0, 1, *([0] * count)])
        simulated = self._simulated.run(self._factors(self._logs + moved), middle[:, None] + around)
        blocks, errors = [], []
        for number, (states, measured) in enumerate(zip(simulated, self._measured, strict=True)):
            rows = self._centered(states[:, :, 0])
            fraction = self._delays[number] - middle[number]
            late = rows[2] - rows[1] if fraction >= 0.0 else rows[1] - rows[0]
            block = np.zeros((len(measured), count + len(self._delays)))
            block[:, :count] = ((rows[3:] - rows[1]) / _STEP).T
            block[:, count + number] = late
            blocks.append(block)
            errors.append(measured - rows[1] - fraction * late)
        matrix, error = np.concatenate(blocks), np.concatenate(errors)
        scale = max(float(np.sqrt(np.mean(error**2))), _LEAST_NOISE)
        prior = np.eye(count, matrix.shape[1]) / _PRIOR
        weighted = np.concatenate([matrix / scale, prior])
        change = np.linalg.lstsq(weighted, np.concatenate([error / scale, -self._logs / _PRIOR]), rcond=None)[0]
        logs = np.clip(self._logs + np.clip(change[:count], -_LONGEST, _LONGEST), -_FARTHEST, _FARTHEST)
        delays = np.clip(self._delays + np.clip(change[count:], -0.5, 0.5), 0.0, self._max_delay)
        return float((error**2).sum()), logs, delays, np.linalg.pinv(weighted.T @ weighted)

    def predict(self) -> list[Floats]:
        """Return positions and velocities of each episode, (n − 1, 2, dof), with the fitted delays and gains."""
        low = np.minimum(np.floor(self._delays), self._max_delay - 1)
        pairs = self._simulated.run(self._factors(np.array([self._logs] * 2)), low[:, None] + np.arange(2))
        return [
            rows[0] + fraction * (rows[1] - rows[0]) for rows, fraction in zip(pairs, self._delays - low, strict=True)
        ]

    def known_delays(self) -> tuple[Estimate, ...]:
        """Return the delays that could be identified."""
        errors = np.sqrt(np.diag(self._covariance)[len(self._logs) :])
        return tuple(
            Estimate(float(value), float(error))
            for value, error in zip(self._delays, errors, strict=True)
            if error <= _UNCERTAIN_DELAY
        )

    def known_gains(self) -> dict[str, Estimate]:
        """Return the factors of the gains that could be identified, by ``"stiffness/joint"``."""
        return {
            name: Estimate(math.exp(log), error)
            for name, (log, error) in self._gains().items()
            if error <= _UNCERTAIN_GAIN
        }

    def problems(self) -> list[str]:
        """Return what could not be identified, and why."""
        found = list(self._still)
        for name, (_, error) in self._gains().items():
            if error > _UNCERTAIN_GAIN:
                found.append(f"{name}: the motion does not determine it (standard error {error:.0%})")
        if not self.known_delays():
            found.append("delay: record a motion with changing velocities")
        return found

    def _gains(self) -> dict[str, tuple[float, float]]:
        """Return the logarithm of each factor and its standard error."""
        found = {}
        for k, (number, i) in enumerate(self._parameters):
            parts = np.zeros(len(self._covariance))
            parts[k] = 1.0
            if number and (0, i) in self._parameters:  # the damping also changes with the factor of both gains
                parts[self._parameters.index((0, i))] = 1.0
            error = math.sqrt(parts @ self._covariance @ parts)
            found[f"{GAINS[number]}/{self._names[i]}"] = float(parts[: len(self._logs)] @ self._logs), error
        return found

    def _factors(self, logs: Floats) -> Floats:
        """Return the factors of the gains, (rows, 2, dof), for the logarithms (rows, k)."""
        factors = np.zeros((len(logs), len(GAINS), len(self._names)))
        for k, (number, i) in enumerate(self._parameters):
            factors[:, number:, i] += logs[:, [k]]
        return np.exp(factors)

    def _scan(self, logs: Floats) -> list[Floats]:
        """Return positions for all whole delays, (max_delay + 1, k) for each episode."""
        delays = np.arange(self._max_delay + 1)
        rows = self._simulated.run(
            self._factors(np.repeat(logs[None], len(delays), axis=0)), np.tile(delays, (len(self._delays), 1))
        )
        return [self._centered(states[:, :, 0]) for states in rows]

    def _errors(self, scanned: Sequence[Floats]) -> Floats:
        """Return the squared error of each episode and row, (episodes, rows)."""
        return np.array(
            [((rows - measured) ** 2).sum(axis=1) for rows, measured in zip(scanned, self._measured, strict=True)]
        )

    def _centered(self, positions: Floats) -> Floats:
        """Return positions (rows, n, dof) of the moving joints without their mean, (rows, n · joints)."""
        chosen = positions[:, _SKIPPED:, self.moving]
        return np.asarray((chosen - chosen.mean(axis=1, keepdims=True)).reshape(len(chosen), -1))


def _noise(
    mirror: Mirror, recordings: Sequence[_Recording], predicted: Sequence[Floats], moving: Sequence[int]
) -> tuple[dict[str, float], float]:
    """Return the noise of each observation term that the joints determine, and the jitter [control steps]."""
    known = MEASURED_TERMS | (GOAL_TERMS if all(each.goal is not None for each in recordings) else set())
    names = [name for name in mirror.sizes if name in known - _WITHOUT_NOISE]
    rough: dict[str, list[Floats]] = {name: [] for name in names}
    speed: dict[str, list[Floats]] = {name: [] for name in names}
    for each, states in zip(recordings, predicted, strict=True):
        true: dict[str, list[Floats]] = {name: [] for name in names}
        mirror.begin(each.joints[0], each.goal)
        for positions, velocities in states:
            mirror.place(np.stack([positions, velocities, 0.0 * positions]), None)
            for feature, values in mirror.observe({}).items():
                for name, value in mirror.split(feature, np.asarray(values[None], np.float64)).items():
                    if name in true:
                        true[name].append(value[0])
        for name in names:
            values = np.array(true[name])[_SKIPPED:]
            difference = each.terms[name][1 + _SKIPPED :] - values
            # The fourth difference of white noise has 70 times its variance. That of a slow error is nearly zero.
            rough[name].append((np.diff(difference, 4, axis=0)[1:-1] ** 2 / 70.0).reshape(-1))
            squares = (values[2:] - values[:-2]) ** 2 / 4.0
            parts = [weight * squares[i : len(squares) - 4 + i] for i, weight in enumerate((1, 16, 36, 16, 1))]
            speed[name].append(np.sum(parts, axis=0).reshape(-1) / 70.0)
    noise, jitter = {}, 0.0
    for name in names:
        variance, late = _variance(np.concatenate(rough[name]), np.concatenate(speed[name]))
        if math.sqrt(variance) > _LEAST_NOISE:
            noise[name] = math.sqrt(variance)
        if name == _POSITIONS and moving:
            jitter = math.sqrt(late)
    return noise, jitter


def _variance(rough: Floats, speed: Floats) -> tuple[float, float]:
    """Return the variances of noise and jitter, where rough ≈ noise + jitter · speed. Slight jitter counts as noise.

    Args:
        rough: Squared error, (n,).
        speed: Squared change in a step, (n,).
    """
    matrix = np.stack([np.ones_like(speed), speed], axis=1)
    weights = np.ones_like(rough)
    for _ in range(4):  # the scatter of a squared error is proportional to its mean
        noise, jitter = np.maximum(np.linalg.lstsq(matrix * weights[:, None], rough * weights, rcond=None)[0], 0.0)
        weights = 1.0 / np.maximum(matrix @ (noise, jitter), 1e-3 * rough.mean() + 1e-30)
    weighted = matrix * weights[:, None]
    error = math.sqrt(4.0 * np.linalg.pinv(weighted.T @ weighted)[1, 1])  # neighbors are correlated
    is_significant = jitter > 4.0 * error and jitter > _LEAST_JITTER**2
    return (float(noise), float(jitter)) if is_significant else (float(rough.mean()), 0.0)

"""Repeats recorded episodes, on the simulator that recorded them or on another one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.kernel.env import RobotEnv
from frobs_core.util.errors import ResetNeededError, SimulationError
from frobs_core.util.validation import validate
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.layout import SETTINGS_PATH
from frobs_data.recorded_features import ACTION, REWARD, SEED, SUCCESS, Vectors
from frobs_train.configuration.config import RunConfig
from frobs_train.environments import make_env
from frobs_train.export.untrusted import check_config


@dataclass(frozen=True, kw_only=True)
class Drift:
    """Distance between the positions of an object on two simulators.

    Attributes:
        largest: Largest distance during the episode [m].
        per_second: Distance at the end, divided by the duration [m/s].
    """

    largest: float
    per_second: float


@dataclass(frozen=True, kw_only=True)
class Replay:
    """Result of repeating the actions of one episode.

    Attributes:
        episode: Number of the episode.
        frames: Number of actions that were repeated.
        simulator: Name of the simulator.
        difference: Largest absolute difference between recorded and repeated vectors and rewards.
        identical: Whether all vectors, rewards and successes are identical bit for bit.
        success: Whether the last step was successful.
        recorded_success: Whether the last recorded step was successful.
        drift: On another simulator, the drift of each robot's tool and of each body. Otherwise, None.
    """

    episode: int
    frames: int
    simulator: str
    difference: float
    identical: bool
    success: bool
    recorded_success: bool
    drift: Mapping[str, Drift] | None = None


def replay(
    folder: Path | str,
    episodes: Sequence[int] | None = None,
    *,
    simulator: str | None = None,
    trust: bool = False,
    on_progress: Callable[[int], object] | None = None,
) -> list[Replay]:
    """Repeat the actions of recorded episodes from their start states.

    On another simulator, the robots and bodies begin at the same positions, at rest, and the task with the same goal.

    Args:
        folder: Folder of a data set that ``frobs record`` has written.
        episodes: Numbers of the episodes, or None for all.
        simulator: Name of the simulator, or None for the simulator of the recording.
        trust: Whether to accept settings that name files or modules.
        on_progress: Called with the number of finished episodes.

    Raises:
        DataError: The data set cannot be replayed, or does not fit its environment.
        UntrustedFileError: The settings name files or modules, and ``trust`` is not set.
        CapabilityError: The other simulator cannot restore positions.
        FrobsError: The environment cannot be built.
    """
    dataset = Dataset(folder)
    environment, kwargs, recorded = _read_settings(dataset, trust)
    numbers = range(len(dataset.episodes)) if episodes is None else episodes
    for number in numbers:
        if not 0 <= number < len(dataset.episodes):
            raise DataError(folder, f"there is no episode {number}; the last one is {len(dataset.episodes) - 1}.")
    with ExitStack() as stack:

        def make(**others: Any) -> RobotEnv:
            env = make_env(environment, {**kwargs, **others})
            stack.callback(env.close)
            base = env.unwrapped
            if not isinstance(base, RobotEnv):
                raise DataError(folder, f"'{environment}' is no FRobs environment, so it has no start states.")
            return base

        env = make()
        other = make(simulator=simulator) if simulator not in (None, recorded) else None
        results = []
        for number in numbers:
            results.append(_Episode(dataset, number, env, other, simulator or recorded).replay())
            if on_progress is not None:
                on_progress(len(results))
    return results


def _read_settings(dataset: Dataset, trust: bool) -> tuple[str, dict[str, Any], str]:
    """Return the Gymnasium ID, the keyword arguments and the simulator of a recording."""
    path, settings = dataset.folder / SETTINGS_PATH, dataset.settings
    if settings is None:
        raise DataError(
            dataset.folder,
            f"{SETTINGS_PATH} is missing, which names the environment; only recordings of 'frobs record' can be replayed.",
        )
    environment, kwargs, simulator = (settings.get(key) for key in ("environment", "environment_kwargs", "simulator"))
    if not isinstance(environment, str) or not isinstance(kwargs, dict) or not isinstance(simulator, str):
        raise DataError(
            path, "'environment', 'environment_kwargs' and 'simulator' must be an ID, a mapping and a name."
        )
    config = validate(RunConfig, {"environment": environment, "environment_kwargs": kwargs}, str(path))
    if not trust:
        check_config(path, config)
    return environment, dict(kwargs), simulator


class _Episode:
    """One recorded episode, to be repeated in one or two environments.

    Args:
        dataset: The data set.
        number: Number of the episode.
        env: Environment on the simulator of the recording.
        other: Environment on another simulator, or None.
        simulator: Name of the simulator that is compared with the recording.

    Raises:
        DataError: The data set does not fit the environment.
    """

    def __init__(self, dataset: Dataset, number: int, env: RobotEnv, other: RobotEnv | None, simulator: str) -> None:
        self._dataset, self._number, self._env, self._other, self._simulator = dataset, number, env, other, simulator
        self._vectors = Vectors((other or env).observations)
        for name, feature in self._vectors.features.items():
            found = dataset.features.get(name)
            if found is None or found.names != feature.names:
                raise DataError(dataset.folder, f"'{name}' does not consist of the terms of the environment.")
        for name in (ACTION, REWARD, SUCCESS, SEED):
            if name not in dataset.features or not dataset.features[name].is_numeric:
                raise DataError(dataset.folder, f"the column '{name}' is missing, so the episodes cannot be replayed.")
        if dataset.features[ACTION].size != int(np.prod(env.action_space.shape or (1,))):
            raise DataError(dataset.folder, f"the actions do not fit the action space {env.action_space}.")
        self._recorded = dataset.columns([*self._vectors.features, ACTION, REWARD, SUCCESS, SEED], [number])
        if not len(self._recorded[SEED]) or self._recorded[SEED][0] < 0:
            raise DataError(dataset.folder, f"episode {number} has no frames, or a negative seed.")

    def replay(self) -> Replay:
        """Repeat the actions, and compare the results with the recording."""
        self._restore()
        env = self._env if self._other is None else self._other
        if self._other is not None:
            self._transfer(self._other)
        recorded = self._recorded
        difference, identical, frames, success = 0.0, True, 0, False
        distances: list[dict[str, float]] = []
        for observation, reward, success in self._steps(env):
            vectors = self._vectors.read(observation)
            pairs = [(vectors[name][0], recorded[name][frames]) for name in vectors]
            pairs.append((np.float32(reward), recorded[REWARD][frames]))
            difference = max(difference, *(float(np.abs(a - b).max(initial=0.0)) for a, b in pairs))
            identical &= all(np.array_equal(a, b) for a, b in pairs) and success == recorded[SUCCESS][frames]
            frames += 1
            if self._other is not None:
                distances.append(_distances(self._env, self._other))
        return Replay(
            episode=self._number,
            frames=frames,
            simulator=self._simulator,
            difference=difference,
            identical=bool(identical) and frames == len(recorded[REWARD]),
            success=bool(success),
            recorded_success=bool(recorded[SUCCESS][-1]),
            drift=_drift(distances, env.control_timestep) if self._other is not None else None,
        )

    def _restore(self) -> None:
        """Restore the start state in the environment on the simulator of the recording."""
        state = self._dataset.start_state(self._number)
        if state is None:
            raise DataError(
                self._dataset.folder,
                f"the start state of episode {self._number} is missing; the simulator that recorded it may not support "
                "snapshots.",
            )
        self._env.reset(seed=int(self._recorded[SEED][0]))
        expected = {name: values for name, values in self._env.snapshot().items() if name != "running"}
        for name, values in expected.items():
            stored = state.get(name)
            if stored is None or stored.ndim != values.ndim or stored.shape[:1] != (1,) or stored.size > 10**7:
                raise DataError(
                    self._dataset.folder,
                    f"the start state of episode {self._number} does not fit the environment ('{name}'); the versions "
                    "of FRobs or of the simulator may differ from those of the recording.",
                )
        try:
            self._env.restore({**{name: state[name] for name in expected}, "running": np.ones(1, bool)})
        except (ValueError, TypeError, KeyError, IndexError) as error:
            reason = str(error).partition("\n")[0]
            raise DataError(
                self._dataset.folder, f"the start state of episode {self._number} cannot be restored: {reason}."
            ) from error

    def _transfer(self, other: RobotEnv) -> None:
        """Begin an episode on the other simulator with the positions and the task of the restored state."""
        other.reset(seed=int(self._recorded[SEED][0]))
        for name, robot in self._env.simulation.robots.items():
            other.simulation.robots[name].write_joint_state(robot.joint_positions.copy())
            if robot.robot.base != "fixed":
                other.simulation.robots[name].write_base_pose(*robot.base_pose)
        for name, body in self._env.simulation.bodies.items():
            try:
                other.simulation.bodies[name].write_pose(*body.pose)
            except SimulationError:  # the body is static
                continue
        other.control.reset(None)
        other.step_context.reset(None)
        other.task.restore(self._env.task.snapshot())

    def _steps(self, env: RobotEnv) -> Iterator[tuple[Any, float, bool]]:
        """Yield the observation before each action, and the reward and the success after it."""
        for action in self._recorded[ACTION]:
            observation = env.observations.observe()
            chosen = np.reshape(action, env.action_space.shape or ())
            try:
                if self._other is not None:
                    self._env.step(chosen)
                _, reward, _, _, info = env.step(chosen)
            except ResetNeededError:  # the episode has already ended here
                return
            yield observation, float(reward), info["is_success"] > 0.5


def _distances(env: RobotEnv, other: RobotEnv) -> dict[str, float]:
    """Return the distance [m] between the two environments' positions of each tool and each body."""
    positions = []
    for each in (env, other):
        robots = each.control.robots
        tools = {
            "tool" if len(robots) == 1 else f"tool of {name}": control.robot.frame_pose("tcp")[0][0]
            for name, control in robots.items()
            if control.robot.tcp
        }
        positions.append(tools | {name: body.pose[0][0] for name, body in each.simulation.bodies.items()})
    return {name: float(np.linalg.norm(position - positions[1][name])) for name, position in positions[0].items()}


def _drift(distances: Sequence[Mapping[str, float]], control_timestep: float) -> dict[str, Drift]:
    duration = len(distances) * control_timestep
    return {
        name: Drift(largest=max(each[name] for each in distances), per_second=distances[-1][name] / duration)
        for name in (distances[0] if distances else ())
    }

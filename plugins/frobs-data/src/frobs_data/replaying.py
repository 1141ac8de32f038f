"""Repeats recorded episodes, on the simulator that recorded them or on another one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
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

_NEEDED = (ACTION, REWARD, SUCCESS, SEED)


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
    environment, kwargs, recorded = read_settings(dataset, trust)
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
                raise DataError(folder, f"'{environment}' is not a FRobs environment, so it has no start states.")
            return base

        env = make()
        other = make(simulator=simulator) if simulator not in (None, recorded) else None
        vectors = Vectors((other or env).observations)
        _check_features(dataset, vectors, env)
        results = []
        for number in numbers:
            columns = dataset.columns([*vectors.features, *_NEEDED], [number])
            seed = max(0, int(columns[SEED][0]))
            _restore(dataset, number, env, seed)
            if other is not None:
                _transfer(env, other, seed)
            results.append(_repeat(number, columns, vectors, simulator or recorded, env, other))
            if on_progress is not None:
                on_progress(len(results))
    return results


def read_settings(dataset: Dataset, trust: bool) -> tuple[str, dict[str, Any], str]:
    """Return the Gymnasium ID, the keyword arguments and the simulator of a recording.

    Args:
        dataset: The data set.
        trust: Whether to accept settings that name files or modules.

    Raises:
        DataError: The data set has no settings, or unusable ones.
        UntrustedFileError: The settings name files or modules, and ``trust`` is not set.
    """
    path, settings = dataset.folder / SETTINGS_PATH, dataset.settings
    if settings is None:
        reason = f"{SETTINGS_PATH} is missing, which names the environment"
        raise DataError(
            dataset.folder, f"{reason}; only what 'frobs record' or 'frobs data import' has written can be replayed."
        )
    environment, kwargs, simulator = (settings.get(key) for key in ("environment", "environment_kwargs", "simulator"))
    if not isinstance(environment, str) or not isinstance(kwargs, dict) or not isinstance(simulator, str):
        rule = "'environment', 'environment_kwargs' and 'simulator' must be an ID, a mapping and a name"
        raise DataError(path, f"{rule}.")
    config = validate(RunConfig, {"environment": environment, "environment_kwargs": kwargs}, str(path))
    if not trust:
        check_config(path, config)
    return environment, dict(kwargs), simulator


def _check_features(dataset: Dataset, vectors: Vectors, env: RobotEnv) -> None:
    for name, feature in vectors.features.items():
        found = dataset.features.get(name)
        if found is None or not found.is_numeric or found.names != feature.names or found.shape != feature.shape:
            raise DataError(dataset.folder, f"'{name}' does not consist of the terms of the environment.")
    for name in _NEEDED:
        size = int(np.prod(env.action_space.shape or (1,))) if name == ACTION else 1
        found = dataset.features.get(name)
        if found is None or not found.is_numeric or found.size != size:
            raise DataError(dataset.folder, f"the column '{name}' is missing, or does not have {size} elements.")


def _restore(dataset: Dataset, number: int, env: RobotEnv, seed: int) -> None:
    """Restore the start state of an episode in the environment on the simulator of the recording."""
    start = f"the start state of episode {number}"
    state = dataset.start_state(number)
    if state is None:
        advice = "the simulator that recorded it may not support snapshots"
        raise DataError(dataset.folder, f"{start} is missing; {advice}.")
    env.reset(seed=seed)
    expected = {name: values for name, values in env.snapshot().items() if name != "running"}
    for name, values in expected.items():
        stored = state.get(name)
        if stored is None or stored.ndim != values.ndim or stored.shape[:1] != (1,) or stored.size > 10**7:
            advice = "the versions of FRobs or of the simulator may differ from those of the recording"
            raise DataError(dataset.folder, f"{start} does not fit the environment ('{name}'); {advice}.")
    try:
        env.restore({**{name: state[name] for name in expected}, "running": np.ones(1, bool)})
    except (ValueError, TypeError, KeyError, IndexError) as error:
        reason = str(error).partition("\n")[0]
        raise DataError(dataset.folder, f"{start} cannot be restored: {reason}.") from error


def _transfer(env: RobotEnv, other: RobotEnv, seed: int) -> None:
    """Begin an episode on another simulator with the positions and the task of the restored state."""
    other.reset(seed=seed)
    for name, robot in env.simulation.robots.items():
        other.simulation.robots[name].write_joint_state(robot.joint_positions.copy())
        if robot.robot.base != "fixed":
            other.simulation.robots[name].write_base_pose(*robot.base_pose)
    for name, body in env.simulation.bodies.items():
        with suppress(SimulationError):  # the body is static
            other.simulation.bodies[name].write_pose(*body.pose)
    other.control.reset(None)
    other.step_context.reset(None)
    other.task.restore(env.task.snapshot())


def _repeat(
    number: int,
    recorded: Mapping[str, np.ndarray[Any, Any]],
    vectors: Vectors,
    simulator: str,
    env: RobotEnv,
    other: RobotEnv | None,
) -> Replay:
    """Repeat the actions of an episode, and compare the results with the recording."""
    compared = env if other is None else other
    steps: list[dict[str, Any]] = []
    distances: list[dict[str, float]] = []
    for action in recorded[ACTION]:
        observation = vectors.read(compared.observations.observe())
        chosen = np.reshape(action, env.action_space.shape or ())
        try:
            if other is not None:
                env.step(chosen)
            _, reward, _, _, info = compared.step(chosen)
        except ResetNeededError:  # the episode has already ended here
            break
        steps.append({name: values[0] for name, values in observation.items()})
        steps[-1] |= {REWARD: np.float32(reward), SUCCESS: info["is_success"] > 0.5}
        if other is not None:
            distances.append(_distances(env, other))
    repeated = {name: np.stack([step[name] for step in steps]) for name in steps[0]}
    differences = [np.abs(repeated[name] - recorded[name][: len(steps)]) for name in (*vectors.features, REWARD)]
    return Replay(
        episode=number,
        frames=len(steps),
        simulator=simulator,
        difference=max(float(difference.max(initial=0.0)) for difference in differences),
        identical=all(np.array_equal(values, recorded[name]) for name, values in repeated.items()),
        success=bool(repeated[SUCCESS][-1]),
        recorded_success=bool(recorded[SUCCESS][-1]),
        drift=_drift(distances, env.control_timestep) if other is not None else None,
    )


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

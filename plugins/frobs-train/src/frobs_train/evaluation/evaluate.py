"""Evaluate the policy of a run on episodes that were not used in training."""

from __future__ import annotations

import hashlib
import logging
import math
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core import plugins
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.plugins.registry import find_spec
from frobs_core.util.errors import RunError
from frobs_core.util.files import write_json
from frobs_core.util.plain import plain, spell_numbers, to_json
from frobs_core.util.validation import whole_number
from frobs_train.configuration.config import RunConfig
from frobs_train.environments import is_paced, make_vector_env
from frobs_train.evaluation.playing import OctantResult, play_episodes
from frobs_train.runs.policy import acting_policy
from frobs_train.runs.policy_run import PolicyRun
from frobs_train.runs.run import Run
from frobs_train.training.seeds import spread_seed
from frobs_train.training.threads import decide_threads

_log = logging.getLogger("frobs")


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Result of an evaluation.

    Attributes:
        success_rate: Fraction of episodes that ended in success, or None if the environment does not report success.
        success_interval: Wilson 95 % confidence interval of the success rate.
        mean_reward: Mean undiscounted return per episode.
        mean_length: Mean episode length [control steps].
        steps_to_success: Mean over the successful episodes of the number of control steps after which the environment
            reported success until the episode ended, or None if no episode was successful.
        tracking_error: Mean tracking error [m] in the second half of each episode, after the robot has had time to
            approach the target. None if the task has no tracking error.
        episodes: Number of episodes.
        success_by_octant: Success statistics for each octant of the goal box. The keys are the signs of the goal
            position relative to the center of the box, such as ``"+x-y+z"``. None if the task has no goal positions.
        environment: Gymnasium ID.
        simulator: Name of the chosen simulator, or None if the training run's simulator was used.
        simulator_kwargs: Settings of the simulator that replaced those from training, or None.
        randomize: Randomization settings, or None if the nominal models were used.
        seed: Seed of the episodes.
        deterministic: Whether the policy's actions were deterministic.
        steps: Number of environment steps for which the policy was trained.
    """

    success_rate: float | None
    success_interval: tuple[float, float] | None
    mean_reward: float
    mean_length: float
    steps_to_success: float | None = None
    tracking_error: float | None = None
    episodes: int
    success_by_octant: Mapping[str, OctantResult] | None
    environment: str
    simulator: str | None
    randomize: Mapping[str, Any] | None
    seed: int
    deterministic: bool
    steps: int
    simulator_kwargs: Mapping[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as JSON-serializable values."""
        return asdict(self)


def evaluate(
    run: Run,
    episodes: int = 1000,
    *,
    simulator: str | None = None,
    randomize: bool | Mapping[str, Any] = False,
    seed: int | None = None,
    num_envs: int | None = None,
    deterministic: bool = True,
    checkpoint: str | int = "newest",
    on_progress: Callable[[int], object] | None = None,
    longest_episode: int | None = None,
) -> Evaluation:
    """Evaluate a checkpoint, and write the result to the run's ``evaluations/`` folder.

    Each environment runs a fixed number of episodes, so that short ones are not overrepresented, with unseen seeds.

    Args:
        run: The run.
        episodes: Exact number of episodes, ≥ 1.
        simulator: Name of the simulator. Defaults to the training run's simulator.
        randomize: False for the nominal models, True for the training run's randomization, or other settings.
        seed: Seed of the episodes, ≥ 0. Defaults to the run's seed.
        num_envs: Number of environments in the vector environment, ≥ 1. By default, the number is chosen automatically.
        deterministic: Whether to use the policy's deterministic actions instead of sampling.
        checkpoint: ``"newest"``, ``"best"`` according to evaluations during training, or a number of environment steps.
        on_progress: Called after each step with the number of finished episodes.
        longest_episode: Number of steps, ≥ 1, after which an episode that has not ended raises an error. Defaults to
            the run's setting. Environments with a time limit are not affected.

    Raises:
        NonFiniteValueError: An observation, a reward, an action or a weight of the policy is not finite.
        EndlessEpisodeError: An episode has not ended after ``longest_episode`` steps.
        EnvironmentFaultError: The environment raised an exception, or does not follow Gymnasium's interface.
        CheckpointError: The checkpoint does not exist, or no checkpoint is usable.
        ConfigurationError: A numeric argument is out of range.
        RunError: The environment's spaces differ from the spaces used in training.
    """
    config = run.config
    chosen_seed = config.seed if seed is None else seed
    assert chosen_seed is not None
    whole_number("episodes", episodes, 1)
    if num_envs is None:
        num_envs = usual_num_envs(config, episodes, simulator)
    longest = config.longest_episode if longest_episode is None else longest_episode
    for name, value, least in (("num_envs", num_envs, 1), ("seed", chosen_seed, 0), ("longest_episode", longest, 1)):
        whole_number(name, value, least)
    kwargs = config.keywords(simulator=simulator, randomize=randomize)
    randomized = plain(kwargs.get("randomize"), for_yaml=True)
    env = make_evaluation_env(config, min(num_envs, episodes), kwargs)
    try:
        with closing(acting_policy(run, env, checkpoint, deterministic)) as policy:
            first = spread_seed(chosen_seed).evaluation
            counter = play_episodes(env, policy, episodes, first, on_progress, longest)
        steps: int = getattr(policy, "steps", 0)  # of a trained policy
    finally:
        env.close()
    successes = counter.successes
    if simulator == {**find_spec(config.environment).kwargs, **config.environment_kwargs}.get("simulator"):
        simulator = None
    result = Evaluation(
        success_rate=float(np.mean(successes)) if successes else None,
        success_interval=wilson_interval(int(sum(successes)), len(successes)) if successes else None,
        mean_reward=float(np.mean(counter.rewards)),
        mean_length=float(np.mean(counter.lengths)),
        steps_to_success=float(np.mean(counter.steps_to_success)) if counter.steps_to_success else None,
        tracking_error=counter.tracking_error,
        episodes=len(counter.rewards),
        success_by_octant=counter.by_octant(),
        environment=config.environment,
        simulator=simulator,
        randomize=randomized,
        seed=chosen_seed,
        deterministic=deterministic,
        steps=steps,
        simulator_kwargs=plain(run.simulator_kwargs, for_yaml=True),
    )
    name = f"step_{steps:09d}_seed{chosen_seed}_{episodes}episodes{f'_{simulator}' if simulator else ''}"
    if run.simulator_kwargs is not None:
        name += f"_simulator-{_digest(result.simulator_kwargs)}"
    if randomized:
        name += "_randomized" if randomize is True else f"_randomized-{_digest(randomized)}"
    if not deterministic:
        name += "_sampled"
    if run.path.is_file() or isinstance(run, PolicyRun):  # only runs have a run folder
        return result
    try:
        path = run.output("evaluations", f"{name}.json")
        write_json(path, result.to_dict())
    except RunError as error:  # return the result anyway
        _log.warning("%s", error)
    except OSError as error:
        _log.warning("%s cannot be written: %s; free some space, or make the folder writable.", path, error.strerror)
    if config.log and checkpoint == "newest" and deterministic:
        from frobs_train.logs.services import log_evaluation

        log_evaluation(run, result)
    return result


def make_evaluation_env(
    config: RunConfig, num_envs: int, kwargs: Mapping[str, Any]
) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Make the environments of an evaluation, with the number of simulator threads that a run may use."""
    threads = decide_threads(config.model_copy(update={"num_envs": num_envs})).simulator
    more = {} if threads is None else {"num_threads": threads}
    return make_vector_env(config.environment, num_envs, {**kwargs, **more}, config.wrappers)


def _digest(settings: Any) -> str:
    text = to_json(spell_numbers(settings), sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=4).hexdigest()


def usual_num_envs(config: RunConfig, episodes: int, simulator: str | None = None) -> int:
    """Return the default number of environments for an evaluation.

    The number is small if each environment is a separate process or engine, and 1 for a paced simulator.
    """
    name = simulator or config.environment_kwargs.get("simulator")
    if is_paced(name):
        return 1
    record = plugins.records("simulator").get(name) if name else None
    alone = isinstance(record, SimulatorRecord) and record.capabilities.get("batched", Level.EXACT) < Level.EXACT
    return min(episodes, 256 if find_spec(config.environment).vector_entry_point is not None and not alone else 16)


def wilson_interval(successes: int, episodes: int) -> tuple[float, float]:
    """Return the Wilson 95 % interval of a proportion (Wilson 1927), in [0, 1].

    The interval always contains the proportion itself.
    """
    z = 1.959963984540054  # 97.5 % quantile of the normal distribution
    rate = successes / episodes
    scale = 1.0 + z * z / episodes
    middle = (rate + z * z / (2 * episodes)) / scale
    half = z * math.sqrt(rate * (1.0 - rate) / episodes + z * z / (4 * episodes * episodes)) / scale
    return min(max(0.0, middle - half), rate), max(min(1.0, middle + half), rate)

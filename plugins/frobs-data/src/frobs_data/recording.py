"""Records episodes of a policy as a data set."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Operator, Policy, Snapshot
from frobs_core.kernel.policies import find_policy, load_policy
from frobs_core.kernel.vector_env import RobotVectorEnv
from frobs_core.plugins.registry import find_spec
from frobs_core.util.arrays import Action, Mask
from frobs_core.util.errors import CapabilityError, ParameterValueError, RunError
from frobs_core.util.keywords import constructor_parameters
from frobs_core.util.plain import plain
from frobs_core.util.validation import whole_number
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.operated import Takeover, play_operated
from frobs_data.recorded_features import (
    ACTION,
    DONE,
    FACTS,
    PICTURES,
    REWARD,
    SEED,
    SUCCESS,
    TERMINATED,
    Camera,
    Vectors,
    picture_features,
    read_cameras,
    step_features,
)
from frobs_data.video import Clip
from frobs_data.writer import DatasetWriter
from frobs_train.environment_checks import has_time_limit
from frobs_train.environments import make_vector_env
from frobs_train.evaluation.evaluate import usual_num_envs
from frobs_train.logs.recorder import EpisodeRecorder
from frobs_train.runs.policy import acting_policy, open_policy
from frobs_train.runs.policy_run import PolicyRun
from frobs_train.runs.run import Run
from frobs_train.runs.versions import versions
from frobs_train.training.interrupts import Interrupts

MOST_ENVS, MOST_ENVS_WITH_CAMERAS = 64, 2
"""Maximum default number of environments. With cameras, encoding the videos takes most of the time."""

_SPARE_ATTEMPTS = 100
_STOPPING = "Recording stops and keeps all whole episodes; %s stops immediately."


class RecordingInterrupt(KeyboardInterrupt):
    """Recording was interrupted, and the whole episodes were kept.

    Args:
        folder: Folder of the data set.
        episodes: Number of episodes that this recording has added.
        signum: Number of the received signal.

    Attributes:
        exit_code: Exit status of a program that is ended by the signal.
    """

    def __init__(self, folder: Path, episodes: int, signum: int) -> None:
        self.folder, self.episodes, self.exit_code = folder, episodes, 128 + signum
        super().__init__(f"{folder} keeps {episodes:,} whole episodes of this recording")


def record(
    environment: str,
    policy: str | Path = "expert",
    *,
    episodes: int,
    out: Path | str,
    seed: int = 0,
    num_envs: int | None = None,
    cameras: Sequence[str] | Mapping[str, Camera | None] | None = None,
    size: Sequence[int] = (96, 96),
    success_only: bool = False,
    append: bool = False,
    takeover: str | None = None,
    simulator: str | None = None,
    settings: Sequence[str] = (),
    trust: bool = False,
    on_progress: Callable[[int, int], object] | None = None,
    **overrides: Any,
) -> Dataset:
    """Record episodes of a policy.

    Each episode has a seed of its own: ``env.reset(seed=…)`` of a single environment begins the same episode. The seeds
    do not depend on ``num_envs``. Each environment records a fixed number of episodes, so that short episodes are not
    overrepresented.

    Args:
        environment: Gymnasium ID of a FRobs environment.
        policy: Name or path of the policy, see :func:`~frobs_core.kernel.policies.load_policy`.
        episodes: Number of episodes to add to the data set, ≥ 1.
        out: Folder of the data set.
        seed: Seed of the first episode, ≥ 0. If ``append`` is set, seeds that were already recorded are skipped.
        num_envs: Number of environments that are simulated in parallel, ≥ 1. By default at most 64, or 2
            with cameras.
        cameras: Cameras whose pictures are recorded, see :func:`~frobs_data.recorded_features.read_cameras`. The policy
            does not see them.
        size: Height and width of the pictures [pixels], even numbers.
        success_only: Whether to record only successful episodes, and to continue until there are enough of them.
        append: Whether to add the episodes to an existing data set.
        takeover: Name of the policy through which a person can act instead of the policy, such as ``"teleop"``. The
            column ``intervention`` marks the steps of the person.
        simulator: Name of the simulator, or None for the simulator of the environment.
        settings: Assignments such as ``"environment_kwargs.robot=ur5"``, for a policy without settings of its own.
        trust: Whether to open policies that execute code or import modules.
        on_progress: Called after each step with the numbers of recorded and of attempted episodes.
        overrides: Keyword arguments of the environment, such as ``controller="joint_position"``.

    Returns:
        The data set.

    Raises:
        DataError: The folder is not empty, contains other data, or cannot be written, or too few episodes are
            successful. Whole episodes are kept.
        RunError: The environment cannot be recorded, or an environment or policy fails.
        ConfigurationError: An argument is invalid.
        RecordingInterrupt: Ctrl-C was pressed. Whole episodes are kept.
    """
    out = Path(out)
    for name, value, least in (("episodes", episodes, 1), ("seed", seed, 0), ("num_envs", num_envs or 1, 1)):
        whole_number(name, value, least)
    views, added = read_cameras(cameras, size)
    if takeover is not None and not _is_operated(takeover):
        raise RunError(f"'{takeover}' is not a policy through which a person acts, such as 'teleop'.")
    run = open_policy(environment, policy, settings=settings, trust=trust)
    config = run.config
    kwargs = {**config.keywords(simulator=simulator, randomize=False), **overrides}
    if added:
        own = {**find_spec(config.environment).kwargs, **kwargs}  # the keyword would replace the cameras of the ID
        kwargs["cameras"] = {**(own.get("cameras") or {}), **added}
    present = Dataset(out) if append and (out / "meta" / "info.json").exists() else None
    if present is not None and SEED in present.features and len(present):
        seed = max(seed, int(present.columns([SEED])[SEED].max()) + 1)
    if takeover is not None or (isinstance(run, PolicyRun) and _is_operated(run.policy)):
        if num_envs not in (None, 1):
            raise ParameterValueError("num_envs", num_envs, "1, because a person acts")
        num_envs = 1
    if num_envs is None:
        most = MOST_ENVS_WITH_CAMERAS if views else MOST_ENVS
        num_envs = min(most, usual_num_envs(config, episodes, simulator))
    with ExitStack() as stack:
        env = make_vector_env(config.environment, min(num_envs, episodes), kwargs, config.wrappers)
        stack.callback(env.close)
        recorder = Recorder(env, views, episodes, success_only, seed)
        facts = {
            "environment": config.environment,
            "environment_kwargs": plain(kwargs, for_yaml=True),
            "simulator": str(getattr(recorder.env.config.simulator, "name", recorder.env.config.simulator)),
            "control_timestep": recorder.env.control_timestep,
            "cameras": views,
        }
        facts["recordings"] = [
            *([] if present is None else _recordings(present, facts)),
            {
                **{"policy": str(policy), "seed": seed, "success_only": success_only, "versions": versions()},
                **({} if takeover is None else {"takeover": takeover}),
            },
        ]
        actor = stack.enter_context(closing(acting_policy(_seeded(run, seed), env)))
        person = None if takeover is None else stack.enter_context(closing(load_policy(takeover, env)))
        interrupts = stack.enter_context(Interrupts(_STOPPING))
        longest = None if has_time_limit(env) else config.longest_episode
        checked = EpisodeRecorder(env, lambda _: None, longest_episode=longest)
        fps = max(1, round(1.0 / recorder.env.control_timestep))
        robot = recorder.env.robot.robot.name
        recorder.open = lambda features: stack.enter_context(
            DatasetWriter(out, fps, features, robot, facts, append=append)
        )
        if isinstance(person, Operator):
            play_operated(env, Takeover(actor, person), person, recorder, interrupts, on_progress)
        elif isinstance(actor, Operator):
            play_operated(env, actor, actor, recorder, interrupts, on_progress)
        else:
            _play(checked, actor, recorder, interrupts, on_progress)
    if interrupts.requested is not None:
        raise RecordingInterrupt(out, recorder.kept, interrupts.requested)
    if recorder.left.any():
        reason = f"only {recorder.kept:,} of {recorder.attempts:,} episodes were successful, which the data set keeps"
        advice = "use a policy with a higher success rate, or record without --success-only"
        raise DataError(out, f"{reason}; {advice}.")
    return Dataset(out)


def _recordings(present: Dataset, facts: Mapping[str, Any]) -> list[Any]:
    """Return the recordings that a data set lists, after checking that it contains the same environment."""
    known = present.settings or {}
    for name, value in facts.items():
        if plain(known.get(name)) != plain(value):
            reason = f"the data set was recorded with {name}={known.get(name)!r:.200}, not {value!r:.200}"
            raise DataError(present.folder, f"{reason}; choose another folder, or the same settings.")
    recordings = known.get("recordings")
    return recordings if isinstance(recordings, list) else []


def _is_operated(policy: str | Path) -> bool:
    """Return whether a person acts through a policy."""
    cls = find_policy(policy).load()
    return isinstance(cls, type) and issubclass(cls, Operator)


def _seeded(run: Run, seed: int) -> Run:
    """Give a policy that draws random numbers the seed of the recording, so that appended episodes differ."""
    if isinstance(run, PolicyRun) and "seed" in constructor_parameters(find_policy(run.policy).load()):
        run.options["seed"] = seed
    return run


def _play(
    env: EpisodeRecorder,
    policy: Policy,
    recorder: Recorder,
    interrupts: Interrupts,
    on_progress: Callable[[int, int], object] | None,
) -> None:
    """Play episodes until the recorder has enough of them, or a signal arrives."""
    observation, _ = env.reset(seed=recorder.seed)
    start = np.ones(env.num_envs, bool)
    recorder.begin(start)
    while recorder.left.any() and interrupts.requested is None and recorder.attempts < recorder.most_attempts:
        action = recorder.stored_action(policy.act(observation, start))
        recorder.before_step(observation, action, policy.info())
        observation, reward, terminated, truncated, info = env.step(action)
        start = terminated | truncated
        recorder.after_step(reward, start, terminated, info["is_success"])
        if on_progress is not None:
            on_progress(recorder.kept, recorder.attempts)


class Recorder:
    """Collects the steps of a vector environment, and writes each episode when it ends.

    Args:
        env: The environment, which may be wrapped.
        views: Settings of the recorded cameras, by name.
        episodes: Number of episodes to record.
        success_only: Whether to discard episodes without success.
        seed: Seed of the first episode.

    Attributes:
        env: The environment without wrappers.
        open: Opens the writer for given features. Called at the first step.
        left: Number of episodes that each environment still has to record, (num_envs,).
        kept: Number of recorded episodes.
        attempts: Number of finished episodes.
        most_attempts: Number of attempts after which so many episodes failed that recording ends.
    """

    open: Callable[[dict[str, Any]], DatasetWriter]

    def __init__(
        self,
        env: gym.vector.VectorEnv[Any, Any, Any],
        views: Mapping[str, Mapping[str, Any]],
        episodes: int,
        success_only: bool,
        seed: int,
    ) -> None:
        base: Any = env.unwrapped
        if not isinstance(base, RobotVectorEnv):
            raise RunError("only FRobs environments can be recorded, without wrappers for single environments.")
        if env.single_action_space != base.single_action_space:
            raise RunError(
                "a wrapper changes the actions, so those of the environment are not known; omit the wrapper."
            )
        self.env, self.seed, self._views, self._success_only = base, seed, views, success_only
        self._unseen = env is not base  # a wrapper may have changed the observation
        num_envs = base.num_envs
        self.left = np.full(num_envs, episodes // num_envs)
        self.left[: episodes % num_envs] += 1
        self.kept = self.attempts = 0
        self.most_attempts = 10 * episodes + _SPARE_ATTEMPTS
        self._seeds = seed + np.arange(num_envs, dtype=np.int64)
        base.before_autoreset.append(self.seed_again)
        self._vectors = Vectors(base.observations)
        self._steps: list[dict[str, np.ndarray[Any, Any]]] = []
        self._begun = np.zeros(num_envs, np.int64)
        space = base.single_action_space
        self._bounds = (space.low, space.high) if isinstance(space, gym.spaces.Box) else None
        self._pictures = picture_features(views, base.observations)
        self._terms = {name: {"type": "camera", **view} for name, view in views.items()}
        self._clips: list[dict[str, Clip]] = [{} for _ in range(num_envs)]
        self._starts: list[Snapshot | None] = [None] * num_envs
        self._writer: DatasetWriter | None = None
        self._task = base.task.instruction or str(base.spec.id if base.spec else base.config.task)

    def stored_action(self, action: Action) -> Action:
        """Return an action as the environment receives it and the data set stores it: clipped, and in float32."""
        if self._bounds is None:
            return np.array(action, np.int64)
        return np.clip(np.asarray(action, np.float32), *self._bounds)

    def begin(self, started: Mask) -> None:
        """Store the start states of the episodes that have just begun in some environments, (num_envs,) bool."""
        self._begun[started | (self.left == 0)] = len(self._steps)
        if oldest := int(self._begun.min()):
            del self._steps[:oldest]
            self._begun -= oldest
        rows = np.flatnonzero(started & (self.left > 0))
        try:
            state = self.env.snapshot() if len(rows) else {}
        except CapabilityError:  # of the simulator; such an episode cannot be replayed
            return
        for row in rows.tolist():
            self._starts[row] = {name: values[row : row + 1].copy() for name, values in state.items()}

    def before_step(self, observation: Any, action: Action, info: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Store what the policy sees and does, (num_envs, …)."""
        if self._writer is None:
            if self._terms:
                self.env.read_terms(self._terms)  # raises errors before a folder is made
            steps = step_features(self.env.control, info)
            self._writer = self.open({**self._vectors.features, **self._pictures, **steps})
        if self._unseen:
            observation = self.env.observations.observe()
        self._steps.append({**self._vectors.read(observation), ACTION: action})
        self._steps[-1] |= {name: np.array(info[name], dtype) for name, dtype in FACTS.items() if name in info}
        if self._pictures:
            self._add_pictures(observation)

    def _add_pictures(self, observation: Any) -> None:
        pictures = self.env.read_terms(self._terms) if self._terms else {}
        for name in self._pictures:
            key = name.removeprefix(PICTURES)
            batch = pictures[key] if key in pictures else observation[key]
            for row in np.flatnonzero(self.left).tolist():
                if name not in self._clips[row]:
                    assert self._writer is not None  # opened above
                    self._clips[row][name] = self._writer.clip(name)
                self._clips[row][name].append(batch[row])

    def after_step(self, reward: Any, done: Mask, terminated: Mask, success: Any) -> None:
        """Store the result of a step, (num_envs,) each, and write the episodes that have ended."""
        self.store(reward, done, terminated, success)
        if done.any():
            self.finish(done)
            self.begin(done)

    def store(self, reward: Any, done: Mask, terminated: Mask, success: Any) -> None:
        """Store the result of a step, (num_envs,) each."""
        self._steps[-1] |= {REWARD: np.array(reward), DONE: done, TERMINATED: np.array(terminated)}
        self._steps[-1][SUCCESS] = np.asarray(success) > 0.5

    def finish(self, done: Mask, *, keep: bool = True) -> None:
        """Write the episodes of some environments, (num_envs,) bool, which end with the latest step, or discard them."""
        rows = np.flatnonzero(done & (self.left > 0)).tolist()
        first = min((int(self._begun[row]) for row in rows), default=0)
        steps = self._steps[first:]
        columns = {name: np.stack([step[name] for step in steps]) for name in steps[0]} if rows else {}
        for row in rows:
            columns[DONE][-1, row] = True
            begun = int(self._begun[row]) - first
            self._finish(row, {name: values[begun:, row] for name, values in columns.items()}, keep)

    def _finish(self, row: int, columns: dict[str, Any], keep: bool) -> None:
        """Write or discard the episode of an environment, whose columns are (n, …)."""
        self.attempts += 1
        clips, self._clips[row] = self._clips[row], {}
        if not keep or (self._success_only and not columns[SUCCESS][-1]):
            for clip in clips.values():
                clip.discard()
            return
        self.kept += 1
        self.left[row] -= 1
        # The seed of the next episode has already been drawn.
        columns[SEED] = np.full(len(columns[DONE]), self._seeds[row] - self.env.num_envs)
        assert self._writer is not None  # opened at the first step
        self._writer.add({**columns, **clips}, self._task, self._starts[row])

    def seed_again(self, mask: Mask) -> None:
        """Give each environment that is about to be reset the seed of its next episode."""
        self._seeds[mask] += self.env.num_envs
        self.env.step_context.rng.seed(self._seeds[mask].tolist(), mask)

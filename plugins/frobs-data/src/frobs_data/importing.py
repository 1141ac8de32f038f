"""Imports ROS bags as episodes of a data set."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.util.errors import ConfigurationError, ParameterValueError, check_name
from frobs_core.util.plain import plain
from frobs_core.util.validation import positive
from frobs_data.bag_episodes import COMMANDS, BagEpisode, Resampler
from frobs_data.bag_topics import IMAGE, TopicNames, picture_of
from frobs_data.bags import Bag
from frobs_data.dataset import Dataset
from frobs_data.errors import DataError
from frobs_data.mirror import Mirror
from frobs_data.recorded_features import ACTION, DONE, PICTURES, REWARD, SEED, SUCCESS, TERMINATED, step_features
from frobs_data.video import Clip
from frobs_data.writer import DatasetWriter
from frobs_train.environments import make_env
from frobs_train.runs.policy_run import PolicyRun
from frobs_train.runs.versions import versions


@dataclass(frozen=True, kw_only=True)
class Imported:
    """Result of an import.

    Attributes:
        dataset: The data set.
        unreachable: Number of frames whose command no action reproduces in one step, for example because it jumps
            further than the velocity limit allows. The data set contains the nearest action.
    """

    dataset: Dataset
    unreachable: int


def import_bags(
    bags: Sequence[Path | str],
    environment: str,
    out: Path | str,
    *,
    namespace: str = "",
    remappings: Sequence[str] = (),
    commands: str | None = None,
    goal: Sequence[float] | None = None,
    max_gap: float | None = None,
    task: str | None = None,
    simulator: str | None = None,
    settings: Sequence[str] = (),
    on_progress: Callable[[str], object] | None = None,
) -> Imported:
    """Import bags of a robot as episodes of a data set for an environment.

    Each bag is one episode. If the topic ``observation`` reports numbers of episodes, as ``frobs ros2 serve`` does, each
    number is one. All bags are read before the data set is written. Rewards and successes are those of the task, if the
    robot and its goal determine them. Otherwise, the data set contains no rewards, and successes only if the topic
    ``observation`` reports them.

    Args:
        bags: Bags of ROS 2: folders, or ``.mcap`` or ``.db3`` files.
        environment: Gymnasium ID of an environment with the same robot. It determines the observation terms, the
            meaning of an action, and the rate.
        out: Folder of the data set to write.
        namespace: Namespace of the robot's topics.
        remappings: Topics with other names, such as ``"joint_states:=/arm/joint_states"``.
        commands: Source of the robot's commands: ``"forward"`` for forwarded commands, ``"trajectory"``, or
            ``"measured"`` for the positions that were measured one step later. None uses the topic that is in the bag.
        goal: Goal of all episodes, (3,) [m] in the world frame. None reads it from the bag.
        max_gap: Largest age of a measurement [s]. By default three control steps, at least 0.2 s.
        task: Sentence that describes the task, or None for the sentence of the environment.
        simulator: Simulator that computes what follows from the joint positions, such as the position of the tool.
        settings: Assignments such as ``"environment_kwargs.controller=joint_position"``.
        on_progress: Called with a text while bags are read and written.

    Raises:
        DataError: A bag is damaged, or does not contain what the environment observes or does.
        RunError: The environment has several robots, a mobile one, or a controller whose actions cannot be computed.
        ConfigurationError: An argument is invalid.
    """
    if commands is not None:
        check_name("source of commands", commands, COMMANDS)
    if goal is not None and not (len(goal) == 3 and np.isfinite(goal).all()):
        raise ParameterValueError("goal", list(goal), "three finite numbers [m]")
    gap = None if max_gap is None else positive("max_gap", max_gap, "s")
    names, report = TopicNames(namespace, remappings), on_progress or (lambda text: None)
    config = PolicyRun("random", environment, settings).config
    kwargs = config.keywords(simulator=simulator, randomize=False)
    with ExitStack() as stack:
        wrapped = make_env(config.environment, kwargs)
        stack.callback(wrapped.close)
        mirror = Mirror(wrapped)
        report(f"importing {mirror.mode} commands")  # an unsuitable controller is an error before anything is read
        read: list[tuple[Bag, list[BagEpisode]]] = []
        for path in bags:
            report(f"reading {path}")
            bag = stack.enter_context(Bag(path))
            read.append((bag, list(Resampler(bag, names, mirror, commands, goal, gap).episodes())))
            if not read[-1][1]:
                raise DataError(path, "no episode has measurements and commands of a whole control step.")
        episodes = [episode for _, some in read for episode in some]
        features = {**mirror.features, **step_features(mirror.env.control, ())}
        if not (mirror.judges and (not mirror.has_goal or all(each.goals is not None for each in episodes))):
            del features[REWARD]
            if not all("success" in named for each in episodes for named in each.named):
                del features[SUCCESS]
        facts = {
            "environment": config.environment,
            "environment_kwargs": plain(kwargs, for_yaml=True),
            "simulator": str(getattr(mirror.env.config.simulator, "name", mirror.env.config.simulator)),
            "control_timestep": mirror.env.control_timestep,
            "cameras": {},
            "recordings": [{"bags": [Path(bag).name for bag in bags], "commands": commands, "versions": versions()}],
        }
        fps, robot = max(1, round(1.0 / mirror.env.control_timestep)), mirror.robot.robot.name
        sentence = task or mirror.env.task.instruction or environment
        followed = []  # all, before anything is written
        for bag, some in read:
            report(f"importing {bag.path}")
            followed.append([_follow(mirror, episode, bag.path) for episode in some])
        writer = DatasetWriter(out, fps, features, robot, facts)
        try:
            with writer:
                for (bag, some), rows in zip(read, followed, strict=True):
                    pictures = _read_pictures(bag, names, some, mirror, writer)
                    for (columns, start, _), clips in zip(rows, pictures, strict=True):
                        columns = {name: values for name, values in columns.items() if name in features}
                        writer.add({**columns, **clips}, sentence, start)
        except BaseException:  # half an import would look like a data set, and block the next try
            shutil.rmtree(out, ignore_errors=True)
            raise
    return Imported(dataset=Dataset(out), unreachable=sum(missed for rows in followed for _, _, missed in rows))


def _follow(mirror: Mirror, episode: BagEpisode, path: Path) -> tuple[dict[str, Any], Mapping[str, Any], int]:
    """Return the columns of an episode, its start state, and the number of its unreachable commands."""
    length = len(episode.commands)
    goals = [None] * (length + 1) if episode.goals is None else list(episode.goals)
    rows: list[dict[str, Any]] = []
    missed = 0
    try:
        start = mirror.begin(episode.joints[0], goals[0])
        for i, command in enumerate(episode.commands):
            row: dict[str, Any] = {**mirror.observe(episode.named[i])}
            row[ACTION], unreachable = mirror.act(command)
            missed += unreachable
            mirror.place(episode.joints[i + 1], goals[i + 1])
            row[REWARD], row[SUCCESS] = mirror.judge()
            if "success" in (named := episode.named[i + 1]):
                row[SUCCESS] = named["success"][0] > 0.5
            rows.append({**row, DONE: i == length - 1, TERMINATED: False, SEED: 0})
    except ConfigurationError as error:
        raise DataError(path, f"the bag does not fit the environment: {error}") from error
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}, start, missed


def _read_pictures(
    bag: Bag, names: TopicNames, episodes: Sequence[BagEpisode], mirror: Mirror, writer: DatasetWriter
) -> list[dict[str, Clip]]:
    """Return the pictures of each episode, in one pass over the bag."""
    clips = [{PICTURES + key: writer.clip(PICTURES + key) for key in mirror.images} for _ in episodes]
    keys = {names.topic(IMAGE.format(key)): key for key in mirror.images}
    seen = dict.fromkeys(keys, 0)
    for time, topic, message in bag.messages(keys) if keys else ():
        key, number = keys[topic], seen[topic]
        seen[topic] += 1
        for episode, some in zip(episodes, clips, strict=True):
            for _ in range(int((episode.images[key] == number).sum())):
                try:
                    some[PICTURES + key].append(picture_of(message, mirror.images[key]))
                except ValueError as error:
                    raise DataError(bag.path, f"the image of '{topic}' at {time:.3f} s: {error}.") from error
    return clips

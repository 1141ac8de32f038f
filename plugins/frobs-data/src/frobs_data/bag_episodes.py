"""Divides bags into episodes, and takes samples at the control rate of an environment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NoReturn

import numpy as np

from frobs_core.contracts import CommandMode
from frobs_core.util.arrays import Floats
from frobs_data.bag_topics import (
    FORWARD,
    GOAL,
    GRIPPER,
    IMAGE,
    JOINT_STATES,
    OBSERVATION,
    TRAJECTORY,
    TopicNames,
    read_topics,
)
from frobs_data.bags import Bag
from frobs_data.errors import DataError
from frobs_data.mirror import GOAL_TERMS, MEASURED_TERMS, Mirror

FORWARDED, PLANNED, MEASURED = COMMANDS = ("forward", "trajectory", "measured")
"""Sources of the commands."""

_SHORTEST_GAP = 0.2  # [s]
_OPTIONAL = {1: ("joint_velocities", "tcp_velocity"), 2: ("joint_efforts",)}
"""Observation terms that follow from the velocities and from the efforts of joint states, which may be missing."""


@dataclass(frozen=True)
class BagEpisode:
    """One episode of a bag, resampled to n + 1 control steps.

    Attributes:
        joints: Positions, velocities and efforts, (n + 1, 3, dof).
        commands: Command of each joint, (n, dof). Joints without commands keep their first position.
        named: Numbers of the topic ``observation`` by name: n + 1 mappings.
        goals: (n + 1, 3) [m] in the world frame, or None.
        images: Number of the message of each frame, (n,) int64, by observation key.
    """

    joints: Floats
    commands: Floats
    named: Sequence[Mapping[str, Floats]]
    goals: Floats | None
    images: Mapping[str, np.ndarray[Any, Any]]


class Resampler:
    """Reads the episodes of a bag. A sample is the latest message at the time of a control step.

    Args:
        bag: The bag.
        names: Names of its topics.
        mirror: The environment for which the episodes are.
        source: Source of the commands, one of :data:`COMMANDS`, or None to use the topic that is in the bag.
        goal: Goal of all episodes, (3,) [m] in the world frame, or None to read it from the bag.
        max_gap: Largest age of a sample [s], or None for three control steps, at least 0.2 s.

    Raises:
        DataError: A topic or joint is missing, or has unusable messages.
    """

    def __init__(
        self,
        bag: Bag,
        names: TopicNames,
        mirror: Mirror,
        source: str | None = None,
        goal: Sequence[float] | None = None,
        max_gap: float | None = None,
    ) -> None:
        self._bag, self._names, self._mirror, self._goal = bag, names, mirror, goal
        self._step = mirror.env.control_timestep
        self._gap = max(_SHORTEST_GAP, 3.0 * self._step) if max_gap is None else max_gap
        self._topics = read_topics(bag, names, mirror.joint_names, mirror.arm, tuple(mirror.images))
        self._source = self._choose_source(source)
        needed = [IMAGE.format(key) for key in mirror.images if IMAGE.format(key) not in self._topics]
        if mirror.fingers and GRIPPER not in self._topics and self._source != MEASURED:
            needed.append(GRIPPER)
        if needed:
            listed = ", ".join(f"'{names.topic(name)}'" for name in needed)
            self._fail(f"the environment also needs the topics {listed}; record them, or name them with --remap")

    def episodes(self) -> Iterator[BagEpisode]:
        """Yield one episode, or one for each number of an episode that the topic ``observation`` reports.

        Of several numbers, those without a whole control step are left out, such as one that begins at the end.

        Raises:
            DataError: The topics do not overlap in time, have a gap, or lack an observation term.
        """
        named, bounds = self._topics.get(OBSERVATION), [-np.inf, np.inf]
        if named is not None and all("episode" in each for each in named.values):
            numbers = np.array([each["episode"][0] for each in named.values])
            bounds[1:1] = named.times[1:][np.diff(numbers) != 0.0].tolist()
        for begin, end in pairwise(bounds):
            if (episode := self._episode(begin, end, is_only=len(bounds) == 2)) is not None:
                yield episode

    def _episode(self, begin: float, end: float, is_only: bool) -> BagEpisode | None:
        topics, step = self._topics, self._step
        pictures = {key: topics[IMAGE.format(key)] for key in self._mirror.images}
        measured = {JOINT_STATES: topics[JOINT_STATES], **{IMAGE.format(key): each for key, each in pictures.items()}}
        measured |= {OBSERVATION: topics[OBSERVATION]} if OBSERVATION in topics else {}
        sent = {FORWARDED: FORWARD.format(self._mirror.mode), PLANNED: TRAJECTORY}.get(self._source)
        spans = {}
        for name, each in {**measured, **({} if sent is None else {sent: topics[sent]})}.items():
            times = each.times[(each.times >= begin) & (each.times < end)]
            if not len(times):  # a bag that is one episode has messages of each topic
                return None
            spans[name] = times[0], times[-1]
        first, last = max(span[0] for span in spans.values()), min(spans[name][1] for name in measured)
        if sent is not None and self._source == FORWARDED:
            last = min(last, spans[sent][1] + step)
        count = int((last - first) / step + 0.5)
        if count < 1 and not is_only:
            return None
        if count < 1:
            common = f"all topics together span {max(0.0, last - first):.3f} s, less than a control step"
            self._fail(f"{common} ({step:g} s); record them at the same time")
        times = first + step * np.arange(count + 1)
        for name, each in measured.items():
            if (ages := times - each.times[each.latest(times)]).max() > self._gap:
                late = f"at {times[np.argmax(ages > self._gap)]:.3f} s, the latest message is too old"
                advice = f"divide the bag there, or allow {ages.max():.3f} s with --max-gap"
                self._fail(f"{name} has a gap: {late}; {advice}")
        joints = topics[JOINT_STATES].values[topics[JOINT_STATES].latest(times)]
        named: list[Mapping[str, Floats]] = [{}] * len(times)
        if OBSERVATION in topics:
            named = [topics[OBSERVATION].values[i] for i in topics[OBSERVATION].latest(times)]
        goals = self._goals(times, named)
        missing = [name for row, terms in _OPTIONAL.items() if np.isnan(joints[:, row]).any() for name in terms]
        self._check_terms(named, goals, missing)
        images = {key: each.latest(times[:-1]) for key, each in pictures.items()}
        return BagEpisode(np.nan_to_num(joints), self._commands(times, joints[:, 0], begin), named, goals, images)

    def _commands(self, times: Floats, measured: Floats, begin: float) -> Floats:
        """Return the command of each frame, (n, dof): the one in the middle of its control step.

        Args:
            times: Times of the control steps, (n + 1,) [s].
            measured: Positions of the joints, (n + 1, dof).
            begin: Time before which messages belong to other episodes [s].
        """
        topics, mirror, middle = self._topics, self._mirror, times[:-1] + 0.5 * self._step
        if self._source == MEASURED:
            return measured[1:].copy()
        commands = np.repeat(measured[:1], len(middle), axis=0)
        if self._source == FORWARDED:
            sent = topics[FORWARD.format(mirror.mode)]
            commands[:, mirror.arm] = sent.values[sent.latest(middle)]
        else:
            for start, trajectory in zip(topics[TRAJECTORY].times, topics[TRAJECTORY].values, strict=True):
                rows, (columns, offsets, points) = (middle >= start) & (start >= begin), trajectory
                position = topics[JOINT_STATES].values[max(0, int(topics[JOINT_STATES].latest(start))), 0]
                if not len(offsets):  # the robot stops
                    commands[rows] = position
                for column, values in zip(columns, np.transpose(points), strict=True):
                    known = [0.0, *(offsets + 1e-9)], [position[column], *values]
                    commands[rows, column] = np.interp(middle[rows] - start, *known)
        if GRIPPER in topics and mirror.fingers:
            latest = topics[GRIPPER].latest(middle)
            columns = [i for i in range(len(measured[0])) if i not in mirror.arm]
            commands[np.ix_(latest >= 0, columns)] = topics[GRIPPER].values[latest[latest >= 0]]
        return commands

    def _goals(self, times: Floats, named: Sequence[Mapping[str, Floats]]) -> Floats | None:
        """Return the goals, (n + 1, 3), or None."""
        samples = self._topics.get(GOAL)
        if self._goal is not None:
            return np.repeat(np.array([self._goal], float), len(times), axis=0)
        if samples is not None:
            return self._mirror.in_world(samples.values[np.maximum(0, samples.latest(times))])
        for name in ("goal", "desired_goal"):
            if all(len(each.get(name, ())) == 3 for each in named):
                return np.stack([each[name] for each in named])
        return None

    def _check_terms(
        self, named: Sequence[Mapping[str, Floats]], goals: Floats | None, unmeasured: Sequence[str]
    ) -> None:
        sizes = self._mirror.sizes
        known = MEASURED_TERMS.difference(unmeasured) | (
            GOAL_TERMS if goals is not None and self._mirror.has_goal else set()
        )
        reported = {name for name in sizes if all(len(each.get(name, ())) == sizes[name] for each in named)}
        missing = [name for name in sizes if name not in known | reported]
        if missing:
            name, goal = missing[0], "the topic 'goal', or --goal, or " if GOAL_TERMS & set(missing) else ""
            topic = f"the topic '{self._names.topic(OBSERVATION)}' with the names {name}/0 to {name}/{sizes[name] - 1}"
            self._fail(f"the bag does not contain the observation terms {', '.join(missing)}; add {goal}{topic}")

    def _choose_source(self, source: str | None) -> str:
        mode, topics = self._mirror.mode, self._topics
        in_position = mode is CommandMode.POSITION
        usable = {FORWARDED: FORWARD.format(mode) in topics, PLANNED: in_position and TRAJECTORY in topics}
        found = [name for name, is_there in usable.items() if is_there] if source is None else [source]
        named = {FORWARDED: self._names.topic(FORWARD.format(mode)), PLANNED: self._names.topic(TRAJECTORY)}
        if len(found) > 1:
            self._fail(f"'{named[FORWARDED]}' and '{named[PLANNED]}' contain commands; choose one with --commands")
        chosen = found[0] if found and usable.get(found[0], in_position) else None
        needed = f"'{named[FORWARDED]}'" + (f" or '{named[PLANNED]}'" if in_position else "")
        advice = ", or use the measured positions with --commands measured" if in_position else ""
        if chosen is None:
            self._fail(f"the commands are missing: the topic {needed}; record it, or name it with --remap{advice}")
        return chosen

    def _fail(self, reason: str) -> NoReturn:
        raise DataError(self._bag.path, f"{reason}.")

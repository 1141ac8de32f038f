"""Collects the topics of one bag that an environment needs, as arrays over time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import ParameterValueError, check_keys
from frobs_data.bags import Bag
from frobs_data.budgets import BAG_BUDGET, BUDGET
from frobs_data.errors import DataError

JOINT_STATES, TRAJECTORY, GRIPPER = (
    "joint_states",
    "joint_trajectory_controller/joint_trajectory",
    "gripper_controller/commands",
)
FORWARD = "forward_{}_controller/commands"
OBSERVATION, GOAL, IMAGE = "observation", "goal", "{}/image_raw"

_ARRAY = "std_msgs/msg/Float64MultiArray"
_TYPES = {
    JOINT_STATES: "sensor_msgs/msg/JointState",
    OBSERVATION: "sensor_msgs/msg/JointState",
    TRAJECTORY: "trajectory_msgs/msg/JointTrajectory",
    GOAL: "geometry_msgs/msg/PointStamped",
    **dict.fromkeys((GRIPPER, *(FORWARD.format(mode) for mode in ("position", "velocity", "effort"))), _ARRAY),
}
_ENCODINGS = {"rgb8": 3, "bgr8": 3, "mono8": 1}


class TopicNames:
    """Names of topics in a bag.

    Args:
        namespace: Namespace of the robot's topics, such as ``"left"``.
        remappings: Rules such as ``"joint_states:=/arm/joint_states"``, as of ROS 2.

    Attributes:
        renamed: Name in the bag of each topic that a rule renames.

    Raises:
        ParameterValueError: A rule has another form.
    """

    def __init__(self, namespace: str = "", remappings: Iterable[str] = ()) -> None:
        self._prefix = "/" + (f"{namespace.strip('/')}/" if namespace.strip("/") else "")
        self.renamed: dict[str, str] = {}
        for rule in remappings:
            name, separator, topic = rule.partition(":=")
            if not separator or not name or not topic:
                raise ParameterValueError("remap", rule, "a rule such as joint_states:=/arm/joint_states")
            self.renamed[name.strip("/")] = topic

    def topic(self, name: str) -> str:
        """Return the absolute name of a topic in the bag, for its name in the documentation."""
        changed = self.renamed.get(name, name)
        return changed if changed.startswith("/") else self._prefix + changed


@dataclass
class Samples:
    """Values over time.

    Attributes:
        times: Increasing times since the start of the bag, (n,) [s].
        values: One value per time, (n, …).
    """

    times: Floats
    values: Any

    def latest(self, times: Floats) -> np.ndarray[Any, Any]:
        """Return the number of the last sample at or before each time, (m,) int64, or −1 if there is none."""
        return np.asarray(np.searchsorted(self.times, times + 1e-9, side="right") - 1)


def read_topics(
    bag: Bag, names: TopicNames, joint_names: Sequence[str], arm_columns: Sequence[int], images: Sequence[str]
) -> dict[str, Samples]:
    """Read everything but the pixels of images from a bag.

    Args:
        bag: The bag.
        names: Names of the topics.
        joint_names: All joints of the robot.
        arm_columns: Numbers of the joints that are not fingers.
        images: Observation keys of images.

    Returns:
        The samples of each topic that has messages, by the topic's name in the documentation: positions, velocities and
        efforts (n, 3, dof) of ``joint_states``; arrays of commands and goals (n, k); columns, times and positions of each
        trajectory; numbers by term of each message of ``observation``; nothing for each image.

    Raises:
        UnknownParameterError: A rule renames a topic that the environment does not need.
        DataError: Joint states or joints are missing, a topic has another type, or a message is damaged, has the wrong
            size, or contains a number that is not finite.
    """
    arm = [joint_names[i] for i in arm_columns]
    types = _TYPES | {IMAGE.format(key): "sensor_msgs/msg/Image" for key in images}
    check_keys("remap", names.renamed, types)
    roles = {names.topic(name): name for name in types}
    for topic, name in roles.items():
        found = bag.topics.get(topic)
        if found is not None and found != types[name]:
            advice = "choose another topic with --remap" + ("; decompress images" if "Compressed" in found else "")
            raise DataError(bag.path, f"the topic '{topic}' has the type {found}, not {types[name]}; {advice}.")
    if names.topic(JOINT_STATES) not in bag.topics:
        advice = f"name it with --remap {JOINT_STATES}:=TOPIC; the bag contains {_listed(bag.topics)}"
        raise DataError(bag.path, f"the topic '{names.topic(JOINT_STATES)}' is missing; {advice}.")
    read: Mapping[str, Callable[[Any], Any]] = {
        JOINT_STATES: lambda message: _joints(message, joint_names),
        OBSERVATION: _named,
        TRAJECTORY: lambda message: _trajectory(message, arm, joint_names),
        GOAL: lambda message: _finite([message.point.x, message.point.y, message.point.z], 3),
        GRIPPER: lambda message: _finite(message.data, len(joint_names) - len(arm)),
        **{
            FORWARD.format(mode): lambda message: _finite(message.data, len(arm))
            for mode in ("position", "velocity", "effort")
        },
        **{IMAGE.format(key): lambda message: () for key in images},
    }
    times: dict[str, list[float]] = {}
    values: dict[str, list[Any]] = {}
    for time, topic, message in bag.messages(roles):
        name = roles[topic]
        try:
            value = read[name](message)
        except (ValueError, TypeError, OverflowError) as error:
            raise DataError(bag.path, f"the message of '{topic}' at {time:.3f} s cannot be used: {error}.") from error
        if value is not None:
            times.setdefault(name, []).append(time)
            values.setdefault(name, []).append(value)
    if JOINT_STATES not in times:
        found = f"no message of '{names.topic(JOINT_STATES)}' names the joints {', '.join(joint_names)}"
        raise DataError(bag.path, f"{found}; check the names, or choose another robot or topic.")
    stacked = {name: values[name] if name in (OBSERVATION, TRAJECTORY) else np.stack(values[name]) for name in values}
    return {name: Samples(np.array(times[name]), stacked[name]) for name in values}


def picture_of(message: Any, size: tuple[int, int]) -> np.ndarray[Any, Any]:
    """Return a ``sensor_msgs/msg/Image`` in another size, (h, w, 3) uint8 RGB, by taking the nearest pixels.

    Raises:
        ValueError: The encoding is not supported, or the size does not match the data.
    """
    channels = _ENCODINGS.get(message.encoding)
    if channels is None:
        raise ValueError(f"the encoding {message.encoding!r:.40} is not supported; use {', '.join(_ENCODINGS)}")
    height, width, step = int(message.height), int(message.width), int(message.step)
    if not 0 < height * width <= BUDGET["pixels of a picture"] or step < width * channels:
        raise ValueError(f"the image has {height} × {width} pixels in rows of {step} bytes")
    if len(message.data) < height * step:
        raise ValueError(f"the image has {len(message.data):,} bytes instead of {height * step:,}")
    rows = np.frombuffer(message.data, np.uint8, height * step).reshape(height, step)
    picture = rows[:, : width * channels].reshape(height, width, channels)
    chosen = picture[np.arange(size[0]) * height // size[0]][:, np.arange(size[1]) * width // size[1]]
    return np.ascontiguousarray(np.broadcast_to(chosen[..., :: -1 if message.encoding == "bgr8" else 1], (*size, 3)))


def _joints(message: Any, joint_names: Sequence[str]) -> Floats | None:
    """Return positions, velocities and efforts, (3, dof), or None if a joint is missing, as in messages of others.

    Velocities and efforts that a message does not contain are NaN.
    """
    present = {name: column for column, name in enumerate(message.name)}
    if not present.keys() >= set(joint_names):
        return None
    columns = [present[name] for name in joint_names]
    if len(message.position) != len(message.name):
        raise ValueError(f"it has {len(message.name)} names and {len(message.position)} positions")
    parts = [_finite(message.position)[columns]]
    for values in (message.velocity, message.effort):  # drivers may leave them out, or fill them with NaN
        usable = len(values) == len(message.name) and np.isfinite(np.asarray(values)[columns]).all()
        parts.append(np.asarray(values, float)[columns] if usable else np.full(len(columns), np.nan))
    return np.stack(parts)


def _named(message: Any) -> dict[str, Floats]:
    """Return numbers that are named ``"term/0"``, ``"term/1"``, … in any order as one array per term."""
    if len(message.name) != len(message.position):
        raise ValueError(f"it has {len(message.name)} names and {len(message.position)} positions")
    parts: dict[str, list[float]] = {}
    rows = zip(message.name, _finite(message.position).tolist(), strict=True)
    for name, value in sorted(rows, key=lambda row: _number(row[0])):
        parts.setdefault(name.partition("/")[0], []).append(value)
    return {name: np.array(part) for name, part in parts.items()}


def _number(name: str) -> int:
    """Return the number of an element from its name, such as 3 for ``"term/3"``."""
    number = name.rpartition("/")[2]
    return int(number) if number.isdecimal() else 0


def _trajectory(message: Any, arm: Sequence[str], joint_names: Sequence[str]) -> tuple[list[int], Floats, Floats]:
    """Return columns, times (n,) and positions (n, k) of a trajectory. One without points stops the robot."""
    names = list(message.joint_names)
    if len(set(names)) < len(names) or not set(names) <= set(arm):
        raise ValueError(f"it names the joints {', '.join(names)[:200]}; the arm has {', '.join(arm)}")
    times = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in message.points]
    if times and (min(times) < 0.0 or (np.diff(times) <= 0.0).any()):
        raise ValueError("its times do not increase")
    positions = [_finite(point.positions, len(names)) for point in message.points]
    return [joint_names.index(name) for name in names], np.array(times), np.array(positions)


def _finite(values: Any, size: int | None = None) -> Floats:
    found = np.asarray(values, float)
    if found.ndim != 1 or len(found) > BAG_BUDGET["elements of a message"]:
        raise ValueError(f"it has {found.size:,} numbers")
    if size is not None and len(found) != size:
        raise ValueError(f"it has {len(found)} numbers instead of {size}")
    if not np.isfinite(found).all():
        raise ValueError("it contains a number that is not finite")
    return found


def _listed(topics: Mapping[str, str]) -> str:
    listed = [f"'{name}'" for name in sorted(topics)]
    return ", ".join(listed[:20]) + (", …" if len(listed) > 20 else "")

"""Observation terms that users add to a task with the ``observations`` keyword."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np

from frobs_core.contracts import RobotHandle, Simulation, Stateful, StepContext
from frobs_core.contracts.control import Control
from frobs_core.description import VECTORS, Marker, ObservationTerm, Scene, Sensor
from frobs_core.kernel.frames import Frames
from frobs_core.plugins.records import Level
from frobs_core.sensing.sensors import Sensors
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import (
    ConfigurationError,
    MissingSettingError,
    ParameterValueError,
    check_keys,
    check_name,
)
from frobs_core.util.random import RandomSource
from frobs_core.util.validation import boolean, choice, image_size

TYPES: Mapping[str, Mapping[str, Any]] = {
    "joint_positions": {"robot": None},
    "joint_velocities": {"robot": None},
    "joint_efforts": {"robot": None},
    "tcp_pose": {"robot": None},
    "body": {"body": ...},
    "contact": {"contact": ...},
    "sensor": {"sensor": ..., "robot": None},
    "previous_action": {},
    "camera": {
        "camera": ...,
        "size": (84, 84),
        "modality": "rgb",
        "fast": True,
        "markers": False,
        "rate": None,
        "noise": 0.0,
        "delay": 0.0,
    },
}
"""Settings that each type of observation term accepts, with their defaults. ``...`` marks names that are required."""

_JOINT_UNITS = {"joint_positions": "rad or m", "joint_velocities": "rad/s or m/s", "joint_efforts": "N·m or N"}

MODALITIES = ("rgb", "depth")

MAX_SIDE = 4_096
"""Maximum height and width of an observed image [pixels]."""


def read_settings(given: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of each added term, including the term's type. Terms set to None are omitted.

    Args:
        given: The keyword ``observations`` of an environment: settings by term.

    Raises:
        ConfigurationError: A term has an unknown type or setting, or a required setting is missing.
    """
    read = {}
    for name, value in given.items():
        if value is None:  # drops the task's term
            continue
        owner = f"observations.{name}"
        if not isinstance(value, Mapping):
            raise ParameterValueError(owner, value, 'a mapping such as {"type": "joint_positions"}')
        kind = str(value.get("type", "camera" if "camera" in value else None))
        defaults = TYPES[check_name(f"type of the observation term '{name}'", kind, TYPES)]
        check_keys(owner, value, {"type", *defaults})
        read[name] = settings = {**defaults, **value, "type": kind}
        for key, default in defaults.items():
            if default is ... and not isinstance(settings[key], str):
                raise MissingSettingError(owner, key, f"write the name of a {key}")
        if kind == "camera":
            settings["size"] = image_size(f"{owner}.size", settings["size"], MAX_SIDE)
            choice(f"{owner}.modality", settings["modality"], MODALITIES)
            boolean(f"{owner}.fast", settings["fast"])
            boolean(f"{owner}.markers", settings["markers"])
    return read


def without_dropped(terms: Mapping[str, ObservationTerm], given: Mapping[str, Any]) -> dict[str, ObservationTerm]:
    """Return a task's terms without the terms that the user sets to None.

    The name ``"*"`` drops all terms except goals.

    Args:
        terms: Terms of the task, by name.
        given: The keyword ``observations`` of an environment: settings by term.

    Raises:
        UnknownNameError: A name to drop does not belong to any of the task's terms.
        ConfigurationError: A goal would be dropped.
    """
    dropped = {name for name, value in given.items() if value is None}
    for name in dropped - {"*"}:
        if terms[check_name("term of the task", name, terms)].key != VECTORS:
            raise ConfigurationError(
                f"the observation term '{name}' cannot be dropped, because goal-conditioned tasks require their goal "
                "terms."
            )
    if "*" in dropped:
        return {name: term for name, term in terms.items() if term.key != VECTORS}
    return {name: term for name, term in terms.items() if name not in dropped}


def needed_capabilities(settings: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Level]]:
    """Return the capabilities that each term requires of the simulator, given the ``settings`` of all added terms."""
    needed = {"camera": "cameras", "contact": "contacts"}
    return {
        f"observations.{name}": {needed[term["type"]]: Level.APPROXIMATE}
        for name, term in settings.items()
        if term["type"] in needed
    }


class AddedTerms(Stateful):
    """Added observation terms, bound to a simulation.

    Args:
        settings: Result of :func:`read_settings`.
        simulation: The simulation to observe.
        scene: Scene of the simulation.
        control: All controllers of the environment.
        context: Step context of the environment.
        markers: Function that returns the task's markers.
        control_timestep: [s]

    Attributes:
        terms: Terms, by name.
        stateful: Whether the terms store state, so that :meth:`reset` and :meth:`advance` must be called.

    Raises:
        UnknownNameError: A robot, body, contact, sensor or camera does not exist.
    """

    def __init__(
        self,
        settings: Mapping[str, Mapping[str, Any]],
        simulation: Simulation,
        scene: Scene,
        control: Control,
        context: StepContext,
        markers: Callable[[], Sequence[Marker]],
        control_timestep: float,
    ) -> None:
        self._simulation, self._scene, self._control, self._markers = simulation, scene, control, markers
        self._measuring: dict[str, Sensors | Frames] = {}
        self.terms: dict[str, ObservationTerm] = {}
        for name, term in settings.items():
            if term["type"] == "sensor":
                self.terms[name] = self._sensor(name, term, control_timestep)
            elif term["type"] == "camera":
                self.terms[name] = self._camera(name, term, control_timestep)
            elif term["type"] == "previous_action":
                self.terms[name] = _previous_action(context, control)
            else:
                self.terms[name] = self._state(name, term)
        self.stateful = bool(self._measuring)

    def reset(self, rng: RandomSource, mask: Mask | None) -> None:
        """Take the first sensor samples of an episode in the environments selected by ``mask``."""
        for sensors in self._measuring.values():
            sensors.reset(mask, rng)

    def advance(self, rng: RandomSource) -> None:
        """Update the sensor measurements once per control step."""
        for sensors in self._measuring.values():
            sensors.advance(rng)

    def stored_parts(self) -> Mapping[str, Sensors | Frames]:
        return self._measuring

    def _robot(self, name: str, term: Mapping[str, Any]) -> tuple[str, RobotHandle]:
        robots = self._simulation.robots
        chosen = next(iter(self._control.robots)) if term["robot"] is None else term["robot"]
        return chosen, robots[check_name(f"robot of the observation term '{name}'", chosen, robots)]

    def _state(self, name: str, term: Mapping[str, Any]) -> ObservationTerm:
        if term["type"] == "body":
            bodies = self._simulation.bodies
            body = bodies[check_name(f"body of the observation term '{name}'", term["body"], bodies)]
            return _unbounded(lambda: np.concatenate(body.pose, axis=1), 7, "m, 1")
        if term["type"] == "contact":
            contact = check_name(f"contact of the observation term '{name}'", term["contact"], self._scene.contacts)
            zero = np.zeros(1)
            return ObservationTerm(
                read=lambda: self._simulation.contact(contact)[:, None], low=zero, high=zero + 1.0, unit="1"
            )
        _, robot = self._robot(name, term)
        if term["type"] == "tcp_pose":
            return _unbounded(lambda: np.concatenate(robot.frame_pose("tcp"), axis=1), 7, "m, 1", proprioceptive=True)
        read = partial(getattr, robot, term["type"])
        return _unbounded(read, robot.dof, _JOINT_UNITS[term["type"]], proprioceptive=True)

    def _sensor(self, name: str, term: Mapping[str, Any], control_timestep: float) -> ObservationTerm:
        robot, handle = self._robot(name, term)
        known: Mapping[str, Sensor] = handle.robot.sensors
        sensor = check_name(f"sensor of the observation term '{name}'", term["sensor"], known)
        self._measuring[name] = sensors = Sensors(self._simulation, control_timestep, robot, [sensor])
        return replace(sensors.term(sensor), imperfect=not known[sensor].is_ideal)

    def _camera(self, name: str, term: Mapping[str, Any], control_timestep: float) -> ObservationTerm:
        camera = check_name(f"camera of the observation term '{name}'", term["camera"], self._scene.cameras)
        size, modality, fast, with_markers = term["size"], term["modality"], term["fast"], term["markers"]
        view = {"camera": camera, **asdict(self._scene.cameras[camera]), "modality": modality, "markers": with_markers}
        for key in ("up", "intrinsics"):
            if view[key] is None:  # omit the key, because older exported policies do not contain it
                del view[key]

        def draw(mask: Mask | None = None) -> np.ndarray[Any, Any]:
            markers = self._markers() if with_markers else ()
            return self._simulation.render(mask, camera, size, modality, markers, fast=fast)

        low: np.ndarray[Any, Any] = (
            np.zeros((*size, 3), np.uint8) if modality == "rgb" else np.zeros((*size, 1), np.float32)
        )
        high, unit = (low + np.uint8(255), "1") if modality == "rgb" else (low + np.float32(np.inf), "m")
        term_of = partial(ObservationTerm, low=low, high=high, unit=unit, key=name, dtype=low.dtype.name, view=view)
        if term["rate"] is None and not term["noise"] and not term["delay"]:
            return term_of(read=draw)
        frames = Frames(name, draw, low, high, term, self._simulation.num_envs, control_timestep)
        self._measuring[name] = frames
        return term_of(read=frames.read, imperfect=not frames.is_ideal)


def _unbounded(read: Callable[[], Floats], width: int, unit: str, proprioceptive: bool = False) -> ObservationTerm:
    far = np.full(width, np.inf)
    return ObservationTerm(read=read, low=-far, high=far, unit=unit, proprioceptive=proprioceptive)


def _previous_action(context: StepContext, control: Control) -> ObservationTerm:
    low, high = _action_bounds(control)
    return ObservationTerm(
        read=lambda: context.action.reshape(-1, len(low)).astype(np.float64),
        low=low,
        high=high,
        unit="1",
        proprioceptive=True,
    )


def _action_bounds(control: Control) -> tuple[Floats, Floats]:
    """Return an action's lower and upper bounds, each of shape (k,). For a Discrete space, k is 1."""
    space: Any = control.action_space
    if hasattr(space, "low"):
        return space.low.astype(np.float64).ravel(), space.high.astype(np.float64).ravel()
    if hasattr(space, "nvec"):
        return np.zeros(len(space.nvec)), space.nvec - 1.0
    return np.array([float(space.start)]), np.array([space.start + space.n - 1.0])

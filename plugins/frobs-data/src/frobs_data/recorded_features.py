"""What ``frobs record`` stores about each step of an environment: names and sources of the features."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.contracts import Control
from frobs_core.description import VECTORS, Observation
from frobs_core.sensing.observation import Observations
from frobs_core.util.errors import ConfigurationError, ParameterValueError
from frobs_data.layout import Feature

STATE, ENVIRONMENT_STATE, ACTION = "observation.state", "observation.environment_state", "action"
PICTURES = "observation.images."
REWARD, DONE, TERMINATED, SUCCESS = "next.reward", "next.done", "next.terminated", "next.success"
PHASE, INTERVENTION, SEED = "phase", "intervention", "seed"

_PER_STEP = {REWARD: "float32", DONE: "bool", TERMINATED: "bool", SUCCESS: "bool", SEED: "int64"}
_VIEW = ("camera", "size", "fast", "markers")

Camera = Mapping[str, Any]
"""Settings of a camera: those of an observation term, and those of a camera that is added to the scene."""


class Vectors:
    """The vector terms of an environment, arranged as the two state features of a data set.

    ``observation.state`` contains the terms that the robot itself can measure, ``observation.environment_state`` all
    other terms. An element is named ``<term>_<i>``, or ``<term>`` if the term has one element.

    Args:
        observations: Observation terms of the environment.

    Attributes:
        features: The features by name. A feature without elements is omitted.
    """

    def __init__(self, observations: Observations) -> None:
        self._parts: dict[str, list[tuple[str, slice]]] = {}
        names: dict[str, list[str]] = {}
        for name, term in observations.terms.items():
            if term.is_vector:
                feature = STATE if term.proprioceptive else ENVIRONMENT_STATE
                size = len(term.low)
                self._parts.setdefault(feature, []).append(observations.columns[name])
                names.setdefault(feature, []).extend([name] if size == 1 else [f"{name}_{i}" for i in range(size)])
        self.features = {
            feature: Feature("float32", (len(names[feature]),), tuple(names[feature]))
            for feature in (STATE, ENVIRONMENT_STATE)
            if feature in names
        }

    def read(self, observation: Observation) -> dict[str, np.ndarray[Any, Any]]:
        """Return the values of the features, (n, k) float32, of n observations."""
        parts = observation if isinstance(observation, dict) else {VECTORS: observation}
        return {
            feature: np.concatenate([parts[key][:, columns] for key, columns in columns_of], axis=1)
            for feature, columns_of in self._parts.items()
        }


FACTS = {PHASE: "int64", INTERVENTION: "bool"}
"""Facts of a policy that are recorded if it reports them, and their types."""


def step_features(control: Control, facts: Collection[str]) -> dict[str, Feature]:
    """Return the features of an action and of its result.

    Args:
        control: All controllers of the environment.
        facts: Names of the facts that the policy reports.

    Raises:
        ConfigurationError: The action space is neither a Box nor discrete.
    """
    space = control.action_space
    if not isinstance(space, gym.spaces.Box | gym.spaces.Discrete | gym.spaces.MultiDiscrete):
        raise ConfigurationError(f"actions of the space {space} cannot be recorded; choose another controller.")
    names = action_names(control)
    dtype = "float32" if isinstance(space, gym.spaces.Box) else "int64"
    features = {ACTION: Feature(dtype, (len(names),), names)}
    features |= {name: Feature(dtype, (1,)) for name, dtype in _PER_STEP.items()}
    return features | {name: Feature(dtype, (1,)) for name, dtype in FACTS.items() if name in facts}


def action_names(control: Control) -> tuple[str, ...]:
    """Return a unique name for each element of an action.

    The names are the ``axes`` of the controllers, or are made from the names of their joint groups.
    """
    listed: list[tuple[str, str]] = []
    for owner, controller in control.controllers.items():
        group = owner.rpartition("/")[2]
        width = (controller.action_space.shape or (1,))[0]
        axes = tuple(getattr(controller, "axes", ()))
        if len(axes) != width:
            axes = (group,) if width == 1 else tuple(f"{group}_{i}" for i in range(width))
        listed += [(owner, axis) for axis in axes]
    names = tuple(axis for _, axis in listed)
    return names if len(set(names)) == len(names) else tuple(f"{owner}/{axis}" for owner, axis in listed)


def read_cameras(
    cameras: Sequence[str] | Mapping[str, Camera | None] | None, size: Sequence[int]
) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
    """Return the observation terms of cameras, and the cameras that must be added to the scene.

    Args:
        cameras: Names of the scene's cameras, or settings by the name of each picture: ``camera`` (the name in the
            scene, if it differs), ``size``, ``fast`` and ``markers`` as in an observation term. All other settings
            define a new camera, as in the environment's keyword ``cameras``.
        size: Height and width of the pictures without a ``size`` of their own [pixels].

    Raises:
        ConfigurationError: The cameras are not names or mappings, or a name cannot be part of a feature's name.
    """
    if not isinstance(cameras, Mapping):
        cameras = dict.fromkeys(cameras or ())
    views, added = {}, {}
    for name, settings in cameras.items():
        if not isinstance(name, str) or not name.replace("_", "").replace("-", "").isalnum():
            raise ParameterValueError("cameras", name, "a name of letters, digits, '_' and '-'")
        if not isinstance(settings, Mapping | None):
            raise ParameterValueError(f"cameras.{name}", settings, "a mapping such as {size: [96, 96]}")
        given = dict(settings or {})
        views[name] = {"camera": name, "size": list(size)} | {key: given[key] for key in _VIEW if key in given}
        definition = {key: value for key, value in given.items() if key not in _VIEW}
        if definition:
            added[views[name]["camera"]] = definition
    return views, added


def picture_features(views: Mapping[str, Mapping[str, Any]], observations: Observations) -> dict[str, Feature]:
    """Return the features of recorded cameras, and of the color pictures that the policy observes."""
    shapes = {name: (*term.low.shape,) for name, term in observations.terms.items() if term.dtype == "uint8"}
    shapes |= {name: (*view["size"], 3) for name, view in views.items()}
    return {PICTURES + name: Feature("video", shape, ("height", "width", "channels")) for name, shape in shapes.items()}

"""Runs the policy from a bundle."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from frobs_deploy.bundle import Bundle, read_bundle
from frobs_deploy.errors import BundleMismatchError, PolicyArgumentError
from frobs_deploy.graph import Graph, input_name
from frobs_deploy.latency import Latency, LatencyWindow
from frobs_deploy.limits import ActionLimits
from frobs_deploy.manifest import Manifest, read_manifest
from frobs_deploy.observation import ObservationReader
from frobs_deploy.spaces import Array, as_floats

_SAME_TIMESTEP = 1e-6  # relative


class Policy:
    """A trained policy that runs with only NumPy and onnxruntime.

    The arguments ``robot``, ``joint_names`` and ``control_timestep`` are compared with the values used in training.
    Pass all three on a real robot, because a policy that was trained for another robot or control rate would move the
    robot incorrectly.

    Args:
        bundle: Path of a bundle file written by ``frobs export``, or a bundle that has already been read.
        robot: Fingerprint of the robot's model file: 64 hexadecimal digits, from
            :func:`frobs_models.fingerprint`.
        joint_names: Joint names in the order of the joint arrays in the observation.
        control_timestep: Time between two actions [s].
        max_change: Maximum change per step in the action's unit, as a number or an array of the action's shape.
            ``"joint_velocity"`` selects the change that the joints' velocity limits allow. By default, the change is
            unlimited.
        num_threads: Number of onnxruntime threads. A single thread is fastest for small networks.

    Attributes:
        bundle: The bundle that contains the policy.
        manifest: The parsed manifest of the bundle.

    Raises:
        BundleError: The file is damaged.
        BundleMismatchError: The robot, its joints or the control rate differ from those used in training.
        PolicyArgumentError: An argument has the wrong shape or value.
        OnnxruntimeMissingError: onnxruntime is not installed.
    """

    def __init__(
        self,
        bundle: Path | str | Bundle,
        *,
        robot: str | None = None,
        joint_names: Sequence[str] | None = None,
        control_timestep: float | None = None,
        max_change: str | float | Array | None = None,
        num_threads: int = 1,
    ) -> None:
        self.bundle = bundle if isinstance(bundle, Bundle) else read_bundle(bundle)
        self.manifest: Manifest = read_manifest(self.bundle)
        if joint_names is not None:
            self._check_joints(joint_names)
        if robot is not None:
            self._check_robot(robot)
        if control_timestep is not None:
            self._check_rate(control_timestep)
        _check_count("num_threads", num_threads, 1, 1_024)
        path = self.bundle.path
        self._observation = ObservationReader(path, self.manifest)
        self._limits = ActionLimits(path, self.manifest, max_change)
        self._graph = Graph(self.bundle, self.manifest.observation, self.manifest.action, num_threads)
        self._latency = LatencyWindow()
        self._scores: Array | None = None
        self.reset()

    @property
    def recurrent(self) -> bool:
        """Whether the policy is recurrent, so that :meth:`reset` must be called at the start of each episode."""
        return bool(self._graph.states)

    @property
    def latency(self) -> Latency:
        """Latency statistics of the last 1,000 calls of :meth:`act`."""
        return self._latency.read()

    @property
    def scores(self) -> Array | None:
        """Scores of the last discrete choice, (choices,) or (n, choices) float, or None if the graph outputs no scores.

        The policy selects the choice with the highest score.
        """
        return self._scores

    def bench(self, actions: int = 1000) -> Latency:
        """Measure the latency of the policy on this machine for typical observations, and reset the policy.

        Args:
            actions: Number of measured actions, after up to 50 warm-up actions.
        """
        _check_count("actions", actions, 0, 10**9)
        observation = {key: space.middle() for key, space in self.manifest.observation.items()}
        given = observation.get("", observation)
        self.reset()
        for _ in range(min(actions, 50)):
            self.act(given)
        self._latency = LatencyWindow(actions)
        for _ in range(actions):
            self.act(given)
        latency, self._latency = self._latency.read(), LatencyWindow()
        self.reset()
        return latency

    def reset(self, mask: Array | None = None, *, previous_action: Array | None = None) -> None:
        """Start a new episode.

        Args:
            mask: Boolean mask of the batch rows to reset, (n,). By default, all rows are reset, and the next batch may
                have any size.
            previous_action: Last action before the reset, in the action's shape or with an additional batch axis. The
                first action may differ from this action, clipped to the action space, by at most ``max_change``. By
                default, the first action is not limited in this way.

        Raises:
            PolicyArgumentError: The mask or the previous action has the wrong shape.
        """
        if mask is None:
            self._state: dict[str, Array] = {}
            previous = None if previous_action is None else self._previous(previous_action)
            self._start: Array | None = None if previous is None else np.ones(len(previous), np.bool_)
            self._limits.reset(previous)
            return
        if previous_action is not None:
            raise PolicyArgumentError(
                "previous_action applies to all rows, so it cannot be combined with a mask; omit the mask."
            )
        try:
            chosen = np.asarray(mask)
        except ValueError:  # rows of different lengths
            chosen = np.empty(0)
        if chosen.dtype != bool or chosen.ndim != 1 or (self._start is not None and chosen.shape != self._start.shape):
            raise PolicyArgumentError(
                f"the mask must be a bool array with one value per row of the batch, not {mask!r:.80}."
            )
        if self._start is not None:
            self._start = self._start | chosen
        self._limits.forget(chosen)

    def act(self, observation: Array | Mapping[str, Array]) -> Any:
        """Return the action for an observation, or the actions for a batch of observations.

        Args:
            observation: An observation with the shape of the observation space, or a batch of observations along an
                additional first axis. A flat observation may also be passed as a mapping of its named terms.

        Returns:
            The action, clipped to the action space. If the observation has a batch axis, the action also has one.

        Raises:
            BundleMismatchError: The observation is not finite or has other names, shapes or types than in training, or
                the batch size changed without a reset.
            BundleError: The network fails.
        """
        began = time.perf_counter()
        parts, single, n = self._observation.read(observation)
        inputs = {input_name(key): value for key, value in parts.items()}
        if self._start is None:
            self._start = np.ones(n, np.bool_)
        elif len(self._start) != n:
            raise BundleMismatchError(
                self.bundle.path, f"the batch size changed from {len(self._start)} to {n}; call reset() first."
            )
        if self._graph.states:
            for name, shape in self._graph.states.items():
                inputs[name] = self._state.get(name, np.zeros((n, *shape), np.float32))
            inputs["episode_start"] = self._start
        outputs = self._graph.run(inputs)
        action = self._limits.apply(outputs["action"])
        self._state = {name: outputs[f"next_{name}"] for name in self._graph.states}
        self._start = np.zeros(n, np.bool_)
        scores = outputs.get("scores")
        self._scores = scores[0] if single and scores is not None else scores
        self._latency.add(time.perf_counter() - began)
        return action[0] if single else action

    def _previous(self, action: Array) -> Array:
        given, shape = as_floats("previous_action", action), self.manifest.action.shape
        if given.shape == shape:
            given = given[None]
        if given.shape[1:] != shape or not np.isfinite(given).all():
            raise PolicyArgumentError(f"previous_action must be a finite array of shape {shape}, not {action!r}.")
        return np.clip(given, self.manifest.action.low, self.manifest.action.high)

    def _check_robot(self, robot: str) -> None:
        trained = self.manifest.robot
        if trained is None:
            raise BundleMismatchError(
                self.bundle.path, "the policy was trained without a robot; omit the 'robot' argument."
            )
        if not re.fullmatch("[0-9a-f]{64}", str(robot)):
            raise PolicyArgumentError(
                f"robot is {robot!r}; it must be a fingerprint of 64 hexadecimal digits, which "
                "frobs_models.fingerprint(frobs_core.models.load_model(FILE)) returns for a model file."
            )
        if robot != trained:
            raise BundleMismatchError(
                self.bundle.path,
                f"the robot differs from the robot used in training: its fingerprint is {robot[:12]}…, not "
                f"{trained[:12]}…; use the model file from training, or train the policy with this model file.",
            )

    def _check_joints(self, given: Sequence[str]) -> None:
        if not isinstance(given, Iterable) or not all(isinstance(name, str) for name in given):
            raise PolicyArgumentError(f"joint_names is {given!r:.80}; it must be a sequence of names.")
        names, trained = tuple(given), self.manifest.joint_names
        if names != trained:
            same = sorted(names) == sorted(trained)
            raise BundleMismatchError(
                self.bundle.path,
                f"the joints are {', '.join(names) or 'none'}, but the policy was trained with "
                f"{', '.join(trained) or 'none'}{'; use this order' if same else ''}.",
            )

    def _check_rate(self, control_timestep: float) -> None:
        trained, given = self.manifest.control_timestep, as_floats("control_timestep", control_timestep)
        if given.shape:
            raise PolicyArgumentError(f"control_timestep is {control_timestep!r:.80}; it must be a single number [s].")
        if trained is None:
            raise BundleMismatchError(
                self.bundle.path,
                "the environment of the policy has no control timestep; omit the 'control_timestep' argument.",
            )
        if not abs(given - trained) <= _SAME_TIMESTEP * trained:
            raise BundleMismatchError(
                self.bundle.path,
                f"control_timestep is {given:g} s, but the policy was trained with {trained:g} s "
                f"({1.0 / trained:g} Hz).",
            )


def _check_count(name: str, value: Any, least: int, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise PolicyArgumentError(f"{name} is {value!r:.80}; it must be an integer from {least} to {most:,}.")

"""Runs the ONNX graph of a policy in onnxruntime."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from frobs_deploy.bundle import GRAPH, Bundle
from frobs_deploy.errors import BundleError, OnnxruntimeMissingError
from frobs_deploy.graph_checks import GraphChecker
from frobs_deploy.onnx_reader import GraphError
from frobs_deploy.spaces import Array, Space

_ERRORS_ONLY = 3
_TYPES = {
    "tensor(float)": "float32",
    "tensor(double)": "float64",
    "tensor(float16)": "float16",
    "tensor(bool)": "bool",
    **{f"tensor({name})": name for name in ("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64")},
}


class Graph:
    """A policy's ONNX graph, which runs on the CPU.

    Args:
        bundle: Bundle that contains the graph.
        observation: Space of each observation part, by key.
        action: Action space.
        num_threads: Number of onnxruntime threads. A single thread is fastest for small networks.

    Attributes:
        states: Shapes of a recurrent policy's states, without the batch axis, by the name of the graph input.
        scores: Whether the graph also outputs scores for discrete choices.
    """

    def __init__(self, bundle: Bundle, observation: Mapping[str, Space], action: Space, num_threads: int) -> None:
        try:
            import onnxruntime
        except ImportError as error:
            raise OnnxruntimeMissingError from error
        self._path = bundle.path
        self._checked: set[int] = set()
        try:
            self._checker = GraphChecker(bundle.graph)
        except GraphError as error:
            raise BundleError(bundle.path, f"{GRAPH} {error}. Export the policy again.") from error
        self._check(1)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads, options.inter_op_num_threads = num_threads, 1
        options.log_severity_level = _ERRORS_ONLY
        try:
            self._session = onnxruntime.InferenceSession(bundle.graph, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime's exceptions have no common base class
            raise BundleError(bundle.path, f"{GRAPH} cannot be loaded: {_first_line(error)}") from error
        self._outputs = [output.name for output in self._session.get_outputs()]
        inputs = {item.name: item for item in self._session.get_inputs()}
        self.states = {name: tuple(item.shape[1:]) for name, item in inputs.items() if name.startswith("state/")}
        self.scores = "scores" in self._outputs
        expected = {input_name(key): (space.dtype.name, space.shape) for key, space in observation.items()}
        recurrent = {name: ("float32", shape) for name, shape in self.states.items()}
        if self.states:
            recurrent["episode_start"] = ("bool", ())
        actual = {name: (_TYPES.get(item.type, item.type), tuple(item.shape[1:])) for name, item in inputs.items()}
        nexts = {f"next_{name}" for name in self.states}
        if actual != expected | recurrent or set(self._outputs) - {"scores"} != {"action"} | nexts:
            raise BundleError(
                bundle.path, f"{GRAPH} does not match the description in bundle.json; export the policy again."
            )
        self._action = action

    def run(self, inputs: Mapping[str, Array]) -> dict[str, Array]:
        """Run the graph on a batch of inputs of shape (n, …), and return the outputs by name.

        Raises:
            BundleError: The graph fails, or returns an action of the wrong shape or scores that are not finite.
        """
        self._check(n := len(next(iter(inputs.values()))))
        try:
            values: list[Any] = self._session.run(self._outputs, dict(inputs))
        except Exception as error:
            raise BundleError(self._path, f"{GRAPH} failed: {_first_line(error)}") from error
        outputs = dict(zip(self._outputs, values, strict=True))
        if np.shape(outputs["action"]) != (n, *self._action.shape):
            raise BundleError(self._path, f"{GRAPH} returned an action of shape {np.shape(outputs['action'])[1:]}.")
        if not np.isfinite(outputs.get("scores", 0.0)).all():
            raise BundleError(
                self._path,
                "the policy's scores of the actions are not finite, because its network diverged; train the "
                "policy again.",
            )
        return outputs

    def _check(self, n: int) -> None:
        """Check the cost of ``n`` observations, because a graph's work need not be proportional to it."""
        if n in self._checked:
            return
        try:
            self._checker.check(n)
        except GraphError as error:
            raise BundleError(self._path, f"{GRAPH} {error}.") from error
        except Exception as error:  # onnxruntime's exceptions have no common base class
            raise BundleError(self._path, f"{GRAPH} cannot be loaded: {_first_line(error)}") from error
        self._checked.add(n)


def input_name(key: str) -> str:
    """Return the name of the graph input for an observation part."""
    return f"observation/{key}" if key else "observation"


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__

"""Exports policies as ONNX graphs that map the raw observation to the environment's action."""

from __future__ import annotations

import contextlib
import logging
import warnings
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
import torch as th
from torch import nn

from frobs_algos.spaces import subspaces
from frobs_core.util.errors import MissingDependencyError

if TYPE_CHECKING:
    import onnx

__all__ = ["OPSET", "TraceablePolicy", "export_graph"]

OPSET = 18
"""Version of ONNX's operator set, which must contain all required operators and be supported by common runtimes on
robots.
"""

_NEEDED = ("onnx", "onnxscript")
_BATCH = 2  # batch size of the example; the tracer treats 0 and 1 specially


class TraceablePolicy(nn.Module):
    """Base class of policies that can be exported.

    ``forward`` takes the tensors of :meth:`examples` in this order, and returns a tuple with the outputs of
    :meth:`output_names`. Inputs and outputs are named as in :meth:`frobs_core.contracts.Algorithm.export_onnx`.

    Args:
        observation_space: Observation space of a single environment.
        action_space: Action space of a single environment.
    """

    state_shapes: Sequence[tuple[int, ...]] = ()
    """Shapes of the state of a recurrent policy, without the batch axis."""

    def __init__(self, observation_space: gym.Space[Any], action_space: gym.Space[Any]) -> None:
        super().__init__()
        self.spaces, self.action_space = subspaces(observation_space), action_space

    def examples(self, batch: int) -> dict[str, th.Tensor]:
        """Return example inputs of the correct shapes and types by name, (batch, …) each."""
        inputs = {
            f"observation/{key}" if key else "observation": th.as_tensor(
                np.zeros((batch, *(space.shape or ())), space.dtype)
            )
            for key, space in self.spaces.items()
        }
        inputs |= {f"state/{i}": th.zeros((batch, *shape)) for i, shape in enumerate(self.state_shapes)}
        return inputs | ({"episode_start": th.zeros(batch, dtype=th.bool)} if self.state_shapes else {})

    def output_names(self) -> list[str]:
        """Return the names of the outputs."""
        names = ["action"] if isinstance(self.action_space, gym.spaces.Box) else ["action", "scores"]
        return names + [f"next_state/{i}" for i in range(len(self.state_shapes))]


def export_graph(build: Callable[[], TraceablePolicy]) -> bytes:
    """Return the ONNX graph of a policy. The same policy always yields the same bytes.

    Args:
        build: Function that returns the policy as a module. The networks return to their device after the export.

    Raises:
        MissingDependencyError: ONNX is not installed.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise MissingDependencyError("the export to ONNX", missing, "pip install 'frobs-algos[export]'")
    graph = build()
    device = next(graph.parameters()).device
    try:
        return _clean(_trace(graph.to("cpu").eval()))
    finally:
        graph.to(device)


def _trace(graph: TraceablePolicy) -> onnx.ModelProto:
    examples = graph.examples(_BATCH)
    batch = th.export.Dim("batch", min=1)
    with _quiet(), th.no_grad():
        program = th.onnx.export(
            graph,
            tuple(examples.values()),
            input_names=list(examples),
            output_names=graph.output_names(),
            # The tracer treats the graph's *args as one argument, whose shape is a tuple with one entry per input.
            dynamic_shapes=(tuple({0: batch} for _ in examples),),
            opset_version=OPSET,
            dynamo=True,
            optimize=True,
            verbose=False,
        )
    assert program is not None
    proto: onnx.ModelProto = program.model_proto
    return proto


def _clean(proto: onnx.ModelProto) -> bytes:
    """Return the bytes of a graph, without the tracer's metadata about the machine."""
    import onnx

    for owner in (proto, proto.graph, *proto.graph.node, *proto.graph.input, *proto.graph.output):
        del owner.metadata_props[:]
        owner.doc_string = ""
    for owner in (*proto.graph.value_info, *proto.graph.initializer):
        del owner.metadata_props[:]
        owner.doc_string = ""
    del proto.graph.value_info[:]
    onnx.checker.check_model(proto, full_check=True)
    return bytes(proto.SerializeToString(deterministic=True))


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress the tracer's messages about optional packages and deprecated Python features."""
    logger = logging.getLogger("torch.onnx")
    others = [logger, logging.getLogger("onnxscript"), logging.getLogger("onnx_ir")]
    before = [(other, other.level) for other in others]
    for other in others:
        other.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for other, level in before:
            other.setLevel(level)

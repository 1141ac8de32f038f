"""Exports policies as ONNX graphs that map the raw observation to the environment's action."""

from __future__ import annotations

import contextlib
import logging
import warnings
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING

import torch as th
from torch import nn

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
    """

    def examples(self, batch: int) -> dict[str, th.Tensor]:
        """Return example inputs of the correct shapes and types by name, (batch, …) each."""
        raise NotImplementedError

    def output_names(self) -> list[str]:
        """Return the names of the outputs."""
        raise NotImplementedError


def export_graph(build: Callable[[], TraceablePolicy], device: th.device | None = None) -> bytes:
    """Return the ONNX graph of a policy. The same policy always yields the same bytes.

    Args:
        build: Function that returns the policy as a module.
        device: Device to which the networks are moved after the export, or None for the CPU.

    Raises:
        MissingDependencyError: ONNX is not installed.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise MissingDependencyError("the export to ONNX", missing, "pip install 'frobs-algos[export]'")
    graph = build().to("cpu").eval()
    try:
        return _clean(_trace(graph))
    finally:
        if device is not None:
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

"""Exports stable-baselines3's policies as ONNX graphs that map the raw observation to the environment's action."""

from __future__ import annotations

import contextlib
import logging
import warnings
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import torch as th
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from frobs_algos_sb3.onnx_observation import ObservationInput
from frobs_algos_sb3.onnx_policy import PolicyGraph, network_of
from frobs_core.util.errors import MissingDependencyError

if TYPE_CHECKING:
    import onnx

OPSET = 18
"""Version of ONNX's operator set, which must contain all required operators and be supported by common runtimes on
robots.
"""

_NEEDED = ("onnx", "onnxscript")
_BATCH = 2  # batch size of the example; the tracer treats 0 and 1 specially


def export_policy(model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]) -> bytes:
    """Return the graph of a model's deterministic policy. The same model always yields the same bytes.

    Inputs and outputs are named as in :meth:`frobs_core.contracts.Algorithm.export_onnx`. The export sets the model to
    evaluation mode, but does not change it otherwise.

    Args:
        model: The model.
        normalizer: Normalizer of the observations, if any.
        space: Observation space of the environment.
    """
    return export_graph(lambda: policy_graph(model, normalizer, space), model.device)


def export_graph(build: Callable[[], PolicyGraph], device: th.device | None = None) -> bytes:
    """Return the ONNX graph of a policy.

    Args:
        build: Function that returns the policy as a module.
        device: Device to which the networks are moved after the export, or None for the CPU.

    Raises:
        MissingDependencyError: ONNX is not installed.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise MissingDependencyError("the export to ONNX", missing, "pip install 'frobs-algos-sb3[export]'")
    graph = build().to("cpu").eval()
    try:
        return _clean(_trace(graph))
    finally:
        if device is not None:
            graph.to(device)


def policy_graph(model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]) -> PolicyGraph:
    """Return a model's deterministic policy as a module, in evaluation mode."""
    inputs = observation_inputs(model, normalizer, space)
    model.policy.set_training_mode(False)
    return PolicyGraph(network_of(model), inputs, model.action_space, bool(model.policy.squash_output))


def observation_inputs(
    model: BaseAlgorithm, normalizer: VecNormalize | None, space: spaces.Space[Any]
) -> dict[str, ObservationInput]:
    """Return the preprocessing for each part of the observation by key. A single array has the key ``""``."""
    seen = model.policy.observation_space
    if isinstance(space, spaces.Dict):
        assert isinstance(seen, spaces.Dict)
        return {key: ObservationInput(inner, seen[key], normalizer, key) for key, inner in space.spaces.items()}
    return {"": ObservationInput(space, seen, normalizer, "")}


def _trace(graph: PolicyGraph) -> onnx.ModelProto:
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

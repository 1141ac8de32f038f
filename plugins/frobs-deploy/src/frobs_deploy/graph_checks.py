"""Computes what one call of a policy's graph costs, before onnxruntime computes anything."""

from __future__ import annotations

import math
from collections.abc import Mapping

from frobs_deploy.budgets import exceeds
from frobs_deploy.onnx_reader import GraphError, Node, OnnxReader

_ELEMENTWISE = frozenset(
    [
        "Abs",
        "Acos",
        "Acosh",
        "Add",
        "And",
        "ArgMax",
        "ArgMin",
        "Asin",
        "Asinh",
        "Atan",
        "Atanh",
        "BatchNormalization",
        "Cast",
        "CastLike",
        "Ceil",
        "Celu",
        "Clip",
        "Concat",
        "Constant",
        "ConstantOfShape",
        "Cos",
        "Cosh",
        "CumSum",
        "DepthToSpace",
        "DequantizeLinear",
        "Div",
        "Dropout",
        "Elu",
        "Equal",
        "Erf",
        "Exp",
        "Expand",
        "Flatten",
        "Floor",
        "Gather",
        "GatherElements",
        "GatherND",
        "Gelu",
        "GlobalAveragePool",
        "GlobalMaxPool",
        "Greater",
        "GreaterOrEqual",
        "GroupNormalization",
        "HardSigmoid",
        "HardSwish",
        "Hardmax",
        "Identity",
        "InstanceNormalization",
        "IsInf",
        "IsNaN",
        "LayerNormalization",
        "LeakyRelu",
        "Less",
        "LessOrEqual",
        "Log",
        "LogSoftmax",
        "LpNormalization",
        "Max",
        "Mean",
        "MeanVarianceNormalization",
        "Min",
        "Mish",
        "Mod",
        "Mul",
        "Neg",
        "Not",
        "OneHot",
        "Or",
        "PRelu",
        "Pad",
        "Pow",
        "QuantizeLinear",
        "RMSNormalization",
        "Range",
        "Reciprocal",
        "ReduceL1",
        "ReduceL2",
        "ReduceLogSum",
        "ReduceLogSumExp",
        "ReduceMax",
        "ReduceMean",
        "ReduceMin",
        "ReduceProd",
        "ReduceSum",
        "ReduceSumSquare",
        "Relu",
        "Reshape",
        "Resize",
        "Round",
        "ScatterElements",
        "ScatterND",
        "Selu",
        "Shape",
        "Sigmoid",
        "Sign",
        "Sin",
        "Sinh",
        "Size",
        "Slice",
        "Softmax",
        "Softplus",
        "Softsign",
        "SpaceToDepth",
        "Split",
        "Sqrt",
        "Squeeze",
        "Sub",
        "Sum",
        "Swish",
        "Tan",
        "Tanh",
        "ThresholdedRelu",
        "Tile",
        "TopK",
        "Transpose",
        "Trilu",
        "Unsqueeze",
        "Where",
        "Xor",
    ]
)
"""Operators whose work is proportional to the size of their inputs and outputs."""

OPERATORS = _ELEMENTWISE | {"AveragePool", "Conv", "Einsum", "Gemm", "MatMul", "MaxPool"}
"""Operators that a graph may contain. Loops, branches, sequences, random numbers and functions are not allowed."""

Shapes = Mapping[str, tuple[int, ...]]


class GraphChecker:
    """Checks the operators of a graph, and the size and work of each value for a number of observations.

    Args:
        graph: Content of the ONNX file.

    Raises:
        GraphError: The graph contains something that is not allowed.
    """

    def __init__(self, graph: bytes) -> None:
        self._reader = OnnxReader(graph)
        for node in self._reader.nodes:
            if node.operator not in OPERATORS:
                raise GraphError(f"contains the operator '{node.operator:.60}', which is not allowed")
        self._probe = self._reader.with_all_outputs()

    def check(self, n: int) -> None:
        """Check the cost of a call with ``n`` observations.

        Raises:
            GraphError: The cost cannot be determined or exceeds a limit.
            Exception: onnxruntime cannot load the graph.
        """
        shapes = {**self._reader.shapes, **self._infer(n)}
        computed = sum(_elements(node, shapes) for node in self._reader.nodes)
        work = sum(_work(node, shapes) for node in self._reader.nodes)
        for what, count in (
            ("elements that the graph computes in one call", computed),
            ("multiplications of the graph per observation", -(-work // n)),
        ):
            if reason := exceeds(what, count):
                raise GraphError(f"needs too much: {reason}; use a smaller network or fewer observations at once")

    def _infer(self, n: int) -> Shapes:
        """Return the shapes that onnxruntime infers, without computing anything."""
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4  # errors are reported by the caller
        for name in self._reader.batch_names:
            options.add_free_dimension_override_by_name(name, n)
        session = onnxruntime.InferenceSession(self._probe, options, providers=["CPUExecutionProvider"])
        shapes = {}
        for value in (*session.get_inputs(), *session.get_outputs()):
            if not value.type.startswith("tensor(") or not all(
                isinstance(size, int) and size >= 0 for size in value.shape
            ):
                raise GraphError(f"computes '{value.name:.60}', whose size is not known before")
            shapes[value.name] = tuple(value.shape)
        return shapes


def _elements(node: Node, shapes: Shapes) -> int:
    if node.operator == "Concat":  # onnxruntime adds the sizes as 32-bit integers
        return sum(math.prod(shapes[name]) for name in node.inputs)
    return sum(math.prod(shapes[name]) for name in node.outputs if name)


def _work(node: Node, shapes: Shapes) -> int:
    """Return a bound on the number of multiplications of a node."""
    given = [shapes[name] for name in node.inputs if name]
    sizes = [math.prod(shape) for shape in given]
    out = [shapes[name] for name in node.outputs if name]
    made = _elements(node, shapes)
    if node.operator == "MatMul":
        return made * (given[0][-1] if given[0] else 1)
    if node.operator == "Gemm":
        return sizes[0] * (out[0][-1] if out[0] else 1)
    if node.operator == "Conv":
        return made * (sizes[1] // max(given[1][0], 1))
    if node.operator in ("AveragePool", "MaxPool"):
        return made * (sizes[0] // max(math.prod(given[0][:2]), 1))
    if node.operator == "Einsum":
        return math.prod(sizes)
    return sum(sizes) + made

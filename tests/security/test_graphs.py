"""A policy's graph is parsed, and is rejected if a call could run forever or take all memory, however it is encoded."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from frobs_deploy import BundleError, Policy, read_bundle
from frobs_deploy.bundle import Bundle
from frobs_deploy.graph_checks import OPERATORS, GraphChecker
from frobs_deploy.onnx_reader import GraphError
from frobs_train.export.pretrained import read_pretrained


@pytest.fixture(scope="module")
def original() -> Bundle:
    return read_pretrained("frobs/Irb120Reach-v0")


@pytest.fixture
def model(original: Bundle) -> onnx.ModelProto:
    return onnx.load_from_string(original.graph)


def opened(original: Bundle, graph: bytes) -> Policy:
    return Policy(Bundle(original.path, original.manifest, graph, original.license))


def constant(name: str, value: object) -> onnx.TensorProto:
    return numpy_helper.from_array(np.asarray(value), name)


def inner() -> onnx.GraphProto:
    true = helper.make_node("Constant", [], ["more"], value=constant("", True))
    return helper.make_graph([true], "inner", [], [helper.make_tensor_value_info("more", TensorProto.BOOL, [])])


def loop() -> onnx.NodeProto:
    body = inner()
    body.input.extend(
        [
            helper.make_tensor_value_info("i", TensorProto.INT64, []),
            helper.make_tensor_value_info("cond", TensorProto.BOOL, []),
        ]
    )
    return helper.make_node("Loop", ["", "go"], [], name="loop", body=body)


def varint(value: int, padding: int = 0) -> bytes:
    encoded = bytearray()
    while value >= 0x80 or padding:
        encoded.append(value & 0x7F | 0x80)
        value, padding = value >> 7, padding - (1 if value < 0x80 and padding else 0)
    return bytes([*encoded, value])


def field(number: int, content: bytes, padding: int = 0) -> bytes:
    return varint(number << 3 | 2, padding) + varint(len(content), padding) + content


def loops() -> Iterator[tuple[str, Callable[[onnx.ModelProto], bytes]]]:
    """Yield a name, and a function that hides a loop in a model."""

    def plainly(model: onnx.ModelProto) -> bytes:
        model.graph.node.append(loop())
        return model.SerializeToString()

    def appended(content: Callable[[], bytes], padding: int = 0) -> Callable[[onnx.ModelProto], bytes]:
        return lambda model: model.SerializeToString() + field(7, content(), padding)

    def first(model: onnx.ModelProto) -> bytes:
        return field(7, field(1, loop().SerializeToString())) + model.SerializeToString()

    def type_last(model: onnx.ModelProto) -> bytes:
        node = loop()
        node.ClearField("op_type")
        node.op_type = "Relu"
        twice = node.SerializeToString() + field(4, b"Loop")
        return model.SerializeToString() + field(7, field(1, twice))

    def padded_type(model: onnx.ModelProto) -> bytes:
        node = loop()
        node.op_type = ""
        return model.SerializeToString() + field(7, field(1, node.SerializeToString() + field(4, b"Loop", 3)))

    def in_a_branch(model: onnx.ModelProto) -> bytes:
        body = inner()
        body.node.append(loop())
        model.graph.node.append(helper.make_node("If", ["go"], ["x"], then_branch=body, else_branch=inner()))
        return model.SerializeToString()

    def in_an_allowed_operator(model: onnx.ModelProto) -> bytes:
        body = inner()
        body.node.append(loop())
        model.graph.node[0].attribute.append(helper.make_attribute("body", body))
        return model.SerializeToString()

    def in_a_function(model: onnx.ModelProto) -> bytes:
        opset = [helper.make_opsetid("", 18)]
        model.functions.append(helper.make_function("own", "Relu", ["x"], ["y"], [loop()], opset))
        model.graph.node.append(helper.make_node("Relu", ["observation"], ["y"], domain="own"))
        return model.SerializeToString()

    def over_a_function_of_the_standard(model: onnx.ModelProto) -> bytes:
        opset = [helper.make_opsetid("", 18)]
        model.functions.append(helper.make_function("", "Relu", ["x"], ["y"], [loop()], opset))
        return model.SerializeToString()

    def as_a_group(model: onnx.ModelProto) -> bytes:
        return (
            model.SerializeToString() + varint(7 << 3 | 3) + field(1, loop().SerializeToString()) + varint(7 << 3 | 4)
        )

    def in_training_information(model: onnx.ModelProto) -> bytes:
        model.training_info.add().algorithm.node.append(loop())
        return model.SerializeToString()

    yield "plainly", plainly
    yield "appended", appended(lambda: field(1, loop().SerializeToString()))
    yield "padded lengths", appended(lambda: field(1, loop().SerializeToString(), 2), 2)
    yield "graph first", first
    yield "type last", type_last
    yield "padded type", padded_type
    yield "in a branch", in_a_branch
    yield "in an allowed operator", in_an_allowed_operator
    yield "in a function", in_a_function
    yield "over a function of the standard", over_a_function_of_the_standard
    yield "as a group", as_a_group
    yield "in training information", in_training_information


@pytest.mark.parametrize("hide", [hide for _, hide in loops()], ids=[name for name, _ in loops()])
def test_a_loop_is_found_in_every_encoding(original, model, hide):
    with pytest.raises(BundleError, match=r"policy\.onnx (contains|is)"):
        opened(original, hide(model))


@pytest.mark.parametrize(
    ("operator", "domain"),
    [("Scan", ""), ("If", ""), ("SequenceMap", ""), ("RandomNormal", ""), ("StringSplit", ""), ("FusedMatMul", "com.microsoft"), ("Relu", "own")],
)  # fmt: skip
def test_operators_that_no_policy_needs_are_rejected(original, model, operator, domain):
    model.graph.node.append(helper.make_node(operator, ["observation"], ["y"], domain=domain))
    with pytest.raises(BundleError, match="contains the operator"):
        opened(original, model.SerializeToString())


def with_nodes(model: onnx.ModelProto, *nodes: onnx.NodeProto, **constants: object) -> bytes:
    model.graph.node.extend(nodes)
    model.graph.initializer.extend(constant(name, value) for name, value in constants.items())
    return model.SerializeToString()


node = helper.make_node
LARGE = {
    "constant of a shape": lambda m: with_nodes(m, node("ConstantOfShape", ["n"], ["y"]), n=[30_000, 30_000]),
    "expand": lambda m: with_nodes(m, node("Expand", ["x", "n"], ["y"]), x=[1.0], n=[30_000, 30_000]),
    "tile": lambda m: with_nodes(m, node("Tile", ["x", "n"], ["y"]), x=[[1.0]], n=[30_000, 30_000]),
    "range": lambda m: with_nodes(m, node("Range", ["a", "b", "c"], ["y"]), a=0, b=10**12, c=1),
    "pad": lambda m: with_nodes(m, node("Pad", ["x", "n"], ["y"]), x=[1.0], n=[10**6, 10**9]),
    "resize": lambda m: with_nodes(
        m,
        node("Resize", ["x", "", "", "n"], ["y"]),
        x=np.ones((1, 1, 1, 1), np.float32),
        n=[1, 1, 30_000, 30_000],
    ),
    "broadcast": lambda m: with_nodes(
        m, node("Add", ["x", "z"], ["y"]), x=np.ones((20_000, 1), np.float32), z=np.ones((1, 20_000), np.float32)
    ),
    "outer product": lambda m: with_nodes(
        m, node("MatMul", ["x", "z"], ["y"]), x=np.ones((20_000, 1), np.float32), z=np.ones((1, 20_000), np.float32)
    ),
    **{
        f"{operator} beyond 32 bits": lambda m, operator=operator, constants=constants, attributes=attributes: (
            with_nodes(m, node(operator, list(constants), ["y"], **attributes), **constants)
        )
        for operator, constants, attributes in (
            ("ConstantOfShape", {"n": [2**32 + 1]}, {}),
            ("Expand", {"x": [1.0], "n": [2**32 + 1]}, {}),
            ("Tile", {"x": [1.0], "n": [2**32 + 1]}, {}),
            ("Range", {"a": 0, "b": 2**32 + 1, "c": 1}, {}),
            ("Pad", {"x": [1.0], "n": [2**31, 2**31]}, {}),
            (
                "Resize",
                {
                    "x": np.ones((1, 1, 1, 1), "f4"),
                    "a": np.ones(0, "f4"),
                    "b": np.ones(0, "f4"),
                    "n": [1, 1, 1, 2**32 + 1],
                },
                {},
            ),
            ("OneHot", {"x": [0], "n": 2**32 + 1, "v": np.ones(2, "f4")}, {}),
            ("Conv", {"x": np.ones((1, 1, 1), "f4"), "w": np.ones((1, 1, 1), "f4")}, {"pads": [2**31, 2**31]}),
        )
    },
    "sum beyond 32 bits": lambda m: with_nodes(
        m,
        node("Expand", ["x", "n"], ["x0"]),
        node("Concat", ["x0"] * 33, ["y"], axis=0),
        x=[1.0],
        n=[2**27],
    ),
    "doubled": lambda m: with_nodes(
        m,
        *(node("Concat", [f"x{i}", f"x{i}"], [f"x{i + 1}"], axis=0) for i in range(60)),
        x0=np.ones(1, np.float32),
    ),
    "gathered": lambda m: with_nodes(
        m,
        node("Gather", ["x", "n"], ["y"]),
        x=np.ones((1, 20_000), np.float32),
        n=np.zeros(20_000, np.int64),
    ),
    "size of the data": lambda m: with_nodes(
        m,
        node("Cast", ["observation"], ["n"], to=TensorProto.INT64),
        node("Reshape", ["n", "k"], ["k1"]),
        node("ConstantOfShape", ["k1"], ["y"]),
        k=[-1],
    ),
    "long chain": lambda m: with_nodes(
        m, *(node("Relu", [f"x{i}"], [f"x{i + 1}"]) for i in range(6_000)), x0=np.ones(1, np.float32)
    ),
    "slow product": lambda m: with_nodes(
        m,
        node("MatMul", ["x", "x"], ["y0"]),
        *(node("MatMul", ["y0", f"y{i}"], [f"y{i + 1}"]) for i in range(30)),
        x=np.ones((1000, 1000), np.float32),
    ),
}


@pytest.mark.parametrize("change", LARGE.values(), ids=LARGE.keys())
def test_a_graph_that_needs_too_much_is_rejected_before_it_runs(original, model, change):
    with pytest.raises(BundleError, match=r"the limit is|not known before"):
        opened(original, change(model))


def test_a_graph_whose_work_grows_with_the_batch_is_rejected_for_a_large_batch(original, model):
    graph = with_nodes(
        model,
        node("Shape", ["observation"], ["s"]),
        node("Gather", ["s", "first"], ["n"]),
        *(node("Mul", [f"n{i}" if i else "n", "n"], [f"n{i + 1}"]) for i in range(3)),
        node("ConstantOfShape", ["n3"], ["y"]),
        first=[0],
    )
    policy = opened(original, graph)
    shape = policy.manifest.observation[""].shape
    policy.act(np.zeros(shape, np.float32))
    policy.reset()
    with pytest.raises(BundleError, match="elements that the graph computes in one call"):
        policy.act(np.zeros((200, *shape), np.float32))


def test_a_declared_shape_is_not_believed(original, model):
    graph = LARGE["size of the data"](model)
    model = onnx.load_from_string(graph)
    model.graph.value_info.append(helper.make_tensor_value_info("y", TensorProto.FLOAT, [1]))
    with pytest.raises(BundleError, match="not known before"):
        opened(original, model.SerializeToString())


def test_tensors_in_other_files_and_sparse_tensors_are_rejected(original, model):
    external = constant("x", [1.0])
    onnx.external_data_helper.set_external_data(external, "/etc/passwd")
    external.ClearField("raw_data")
    for change in (
        lambda m: m.graph.initializer.append(external),
        lambda m: m.graph.node.append(node("Constant", [], ["y"], value=external)),
        lambda m: m.graph.sparse_initializer.add(),
        lambda m: m.graph.node.append(node("Constant", [], ["y"], sparse_value=onnx.SparseTensorProto(dims=[10**9]))),
        lambda m: m.graph.initializer.add(name="x", dims=[30_000, 30_000], data_type=1),
    ):
        changed = onnx.ModelProto()
        changed.CopyFrom(model)
        change(changed)
        with pytest.raises(BundleError, match="contains"):
            opened(original, changed.SerializeToString())


@pytest.mark.parametrize(
    "graph", [b"\xff" * 20, b"\x3a\xff\xff\xff\xff\x0f", b"\x3b", b"\x38\x00", b"\x0a\x81\x00", b"\0" * 100]
)
def test_other_bytes_are_rejected(graph):
    with pytest.raises(GraphError):
        GraphChecker(graph)


def test_every_prefix_of_a_graph_is_rejected_or_read(original):
    for length in range(0, len(original.graph), 997):
        try:
            opened(original, original.graph[:length])
        except BundleError:
            continue
        pytest.fail(f"the first {length} bytes were accepted")


def test_many_fields_are_counted(original):
    with pytest.raises(BundleError, match="fields of the graph; the limit is 200,000"):
        opened(original, original.graph + b"\x08\x01" * 10**6)


def test_the_reader_finds_what_onnx_finds(original, model):
    checker = GraphChecker(original.graph)
    assert [item.operator for item in checker._reader.nodes] == [item.op_type for item in model.graph.node]
    assert checker._reader.shapes == {item.name: tuple(item.dims) for item in model.graph.initializer}
    assert {item.op_type for item in model.graph.node} <= OPERATORS


def test_the_operators_are_of_the_standard():
    names = {schema.name for schema in onnx.defs.get_all_schemas() if schema.domain == ""}
    assert names >= OPERATORS


def test_the_written_file_is_still_read(tmp_path, original):
    assert Policy(read_bundle(original.path)).act(np.zeros(Policy(original).manifest.observation[""].shape, "f4")).size

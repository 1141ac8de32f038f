"""Bundles of tiny policies, written down by hand: what they answer can be computed in the head."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from frobs_deploy import pack_bundle

JOINTS = ("shoulder", "elbow")
ROBOT = "ab" * 32


def space(size: int, bound: float | None = 1.0, **changes: Any) -> dict[str, Any]:
    """Return a Box of floats."""
    low = None if bound is None else -bound
    return {"type": "Box", "shape": [size], "dtype": "float32", "low": low, "high": bound, **changes}


def manifest(**changes: Any) -> dict[str, Any]:
    """Return what a bundle of a two-joint arm says."""
    return {
        "environment": {"id": "Arm-v0"},
        "control_timestep": 0.04,
        "robot": {
            "name": "arm",
            "fingerprint": ROBOT,
            "xacro_args": {},
            "joints": [{"name": name} for name in JOINTS],
        },
        "controller": {"name": "joint_position"},
        "action": {"space": space(2), "max_change": [0.1, None]},
        "observation": {
            "spaces": {"": space(3, None)},
            "terms": [{"name": "joint_positions", "columns": [0, 1]}, {"name": "height", "columns": [2, 2]}],
        },
        **changes,
    }


def graph(nodes: list[Any], inputs: Mapping[str, Any], outputs: Mapping[str, Any], **constants: Any) -> bytes:
    """Return a graph; inputs and outputs are (type, shape without the batch)."""

    def info(name: str, kind: int, shape: tuple[int, ...]) -> Any:
        return helper.make_tensor_value_info(name, kind, ["batch", *shape])

    made = helper.make_graph(
        nodes,
        "policy",
        [info(name, *what) for name, what in inputs.items()],
        [info(name, *what) for name, what in outputs.items()],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()],
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 18)], ir_version=8)
    onnx.checker.check_model(model)
    data: bytes = model.SerializeToString()
    return data


def first_two() -> bytes:
    """Return a graph whose action is the first two numbers of the observation, however large."""
    return graph(
        [helper.make_node("MatMul", ["observation", "pick"], ["action"])],
        {"observation": (TensorProto.FLOAT, (3,))},
        {"action": (TensorProto.FLOAT, (2,))},
        pick=np.eye(3, 2, dtype=np.float32),
    )


def summing() -> bytes:
    """Return a recurrent graph: the action is the sum of the observations since the episode's start."""
    return graph(
        [
            helper.make_node("Not", ["episode_start"], ["going"]),
            helper.make_node("Cast", ["going"], ["kept"], to=TensorProto.FLOAT),
            helper.make_node("Unsqueeze", ["kept", "axis"], ["column"]),
            helper.make_node("Mul", ["state/0", "column"], ["before"]),
            helper.make_node("Add", ["before", "observation"], ["next_state/0"]),
            helper.make_node("Identity", ["next_state/0"], ["action"]),
        ],
        {
            "observation": (TensorProto.FLOAT, (1,)),
            "state/0": (TensorProto.FLOAT, (1,)),
            "episode_start": (TensorProto.BOOL, ()),
        },
        {"action": (TensorProto.FLOAT, (1,)), "next_state/0": (TensorProto.FLOAT, (1,))},
        axis=np.array([1]),
    )


def choosing() -> bytes:
    """Return a graph that chooses the greatest of the two keys' three numbers, added."""
    return graph(
        [
            helper.make_node("Add", ["observation/a", "observation/b"], ["scores"]),
            helper.make_node("ArgMax", ["scores"], ["action"], axis=1, keepdims=0),
        ],
        {"observation/a": (TensorProto.FLOAT, (3,)), "observation/b": (TensorProto.FLOAT, (3,))},
        {"action": (TensorProto.INT64, ()), "scores": (TensorProto.FLOAT, (3,))},
    )


def write(path: Path, network: bytes | None = None, license: str = "MIT\n", **changes: Any) -> Path:
    """Write a bundle of the two-joint arm, or of what ``changes`` say."""
    path.write_bytes(pack_bundle(manifest(**changes), first_two() if network is None else network, license))
    return path


def write_summing(path: Path) -> Path:
    """Write a recurrent bundle without a robot."""
    one = space(1, 100.0)
    return write(
        path,
        summing(),
        robot=None,
        action={"space": one, "max_change": None},
        observation={"spaces": {"": one}, "terms": []},
    )


def seeing() -> bytes:
    """Return a graph whose action is the mean of the image's pixels, of which 255 is 1."""
    return graph(
        [
            helper.make_node("Cast", ["observation/eye"], ["pixels"], to=TensorProto.FLOAT),
            helper.make_node("ReduceMean", ["pixels", "axes"], ["mean"], keepdims=0),
            helper.make_node("Div", ["mean", "white"], ["share"]),
            helper.make_node("Unsqueeze", ["share", "axis"], ["action"]),
        ],
        {"observation/eye": (TensorProto.UINT8, (2, 3, 3))},
        {"action": (TensorProto.FLOAT, (1,))},
        axes=np.array([1, 2, 3]),
        white=np.float32(255.0),
        axis=np.array([1]),
    )


IMAGE = {
    "camera": "wrist",
    "frame": "robot/hand",
    "pos": [0.0, 0.0, 0.1],
    "target": [0.0, 0.0, 1.0],
    "fov_y": 60.0,
    "modality": "rgb",
    "markers": True,
    "unit": "1",
}


def write_seeing(path: Path, **changes: Any) -> Path:
    """Write a bundle whose observation is an image; ``changes`` are those of its record."""
    pixels = {"type": "Box", "shape": [2, 3, 3], "dtype": "uint8", "low": 0, "high": 255}
    return write(
        path,
        seeing(),
        action={"space": space(1), "max_change": None},
        observation={"spaces": {"eye": pixels}, "terms": [], "images": {"eye": {**IMAGE, **changes}}},
    )


def write_choosing(path: Path) -> Path:
    """Write a bundle with a Dict observation and a discrete action."""
    choice = {"type": "Discrete", "shape": [], "dtype": "int64", "low": 0, "high": 2}
    return write(
        path,
        choosing(),
        action={"space": choice, "max_change": None},
        observation={"spaces": {"a": space(3), "b": space(3)}, "terms": []},
    )

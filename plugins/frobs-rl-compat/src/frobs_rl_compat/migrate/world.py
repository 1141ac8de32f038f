"""Converts a recognized Kobuki task's world to a floor plan with walls, boxes, start poses, and goals or routes."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from frobs_models import Element, Packages, parse_xml, read_bytes
from frobs_rl_compat.migrate.package import OldPackage
from frobs_rl_compat.migrate.values import UntranslatableError, bounds_of, check_any_heading, value_of

STEP = 0.2
"""Duration of a step in the navigation tasks [s]."""


def check_world_is_empty(package: OldPackage) -> None:
    """Check that the launched world files contain only a ground plane and lights.

    Raises:
        UntranslatableError: A world file contains other models, or is not in the package.
    """
    launched = [keyword.value for call in package.calls("launch_Gazebo") for keyword in call.keywords
                if keyword.arg == "custom_world_name"]  # fmt: skip
    names = {_text(name) for name in launched} | {str(package.constructed.parameters.get("world_filename"))}
    for name in names - {"None"}:
        files = sorted(package.folder.rglob(name))
        if not files:
            raise UntranslatableError(f"the package does not contain the world file {name}")
        root = parse_xml(read_bytes(files[0]), files[0])
        held = {element.get("name", "") for element in root.iter("model")}
        held |= {(element.findtext("uri") or "").rpartition("/")[2] for element in root.iter("include")}
        if held - {"ground_plane", "sun"}:
            raise UntranslatableError(f"the world {name} contains {', '.join(sorted(held - {'ground_plane', 'sun'}))}")


def read_floor_plan(name: str, package: OldPackage) -> dict[str, Any]:
    """Return a floor plan with a world's walls, boxes, start, and goals or routes."""
    begin = package.lineage[0].methods["_set_episode_init_params"]
    if name == "empty":
        low, high = bounds_of(package, "self.robot_pos_space")
        check_any_heading(low[2], high[2])
        goal_low, goal_high = bounds_of(package, "self.goal_space")
        return {"start": {"low": low[:2], "high": high[:2]}, "goals": {"low": goal_low, "high": goal_high}}
    turned_low, turned_high = bounds_of(package, "self.angle_space")
    check_any_heading(turned_low[0], turned_high[0])
    placed = {_text(call.args[0]): _position(call) for call in _calls(begin, "gazebo_set_model_state")}
    robot = package.constructed.parameters.get("model_name_in_gazebo")
    if robot not in placed:
        raise UntranslatableError(f"no method places the robot '{robot}' at the beginning of an episode")
    x, y, _ = placed.pop(robot)
    spawned = dict(_spawned(package))
    plan: dict[str, Any] = {
        "walls": {"pieces": [wall for name, (file, place) in spawned.items() if name not in placed
                             for wall in read_walls(file, place)]},
        "boxes": _boxes(name, package, placed, {name: file for name, (file, _) in spawned.items()}),
        "start": {"pos": [x, y]},
    }  # fmt: skip
    if name == "maze":
        count = int(value_of(package, "self.traj_space").n)
        plan["routes"] = [value_of(package, f"traj{number}").tolist() for number in range(1, count + 1)]
    else:
        sampled = next(ast.unparse(node.value) for node in ast.walk(begin) if isinstance(node, ast.Assign)
                       and ast.unparse(node.targets[0]) == "self.goal_pos")  # fmt: skip
        goal_low, goal_high = bounds_of(package, sampled.removesuffix(".sample()"))
        plan["goals"] = {"low": goal_low, "high": goal_high}
    return plan


def _boxes(
    name: str, package: OldPackage, placed: Mapping[str, tuple[float, float, float]], files: Mapping[str, Path]
) -> list[dict[str, Any]]:
    """Return the moving boxes.

    Args:
        name: Name of the example task.
        package: The package.
        placed: Position of each box at the beginning of an episode [m].
        files: SDF file of each box.
    """
    low, high = bounds_of(package, "self.boxes_vel_space")
    if any(low) or len(high) != len(placed):
        raise UntranslatableError("boxes_vel_space must have one component per box, and all lower bounds must be 0")
    steps = float(value_of(package, "self.box_traj_num_steps"))
    first = steps / 2.0 * STEP
    boxes = []
    for (box, (x, y, z)), speed in zip(placed.items(), high, strict=True):
        shapes = list(_shapes(files[box], 0j, with_pose=False))
        if len(shapes) != 1 or abs(shapes[0].centre) > 1e-9 or shapes[0].yaw:
            raise UntranslatableError(f"{files[box]} is not a single, unrotated box centered at the model's origin")
        length, width, height = shapes[0].size
        top = z + shapes[0].height + height / 2.0  # parts below the floor are ignored
        if top <= 0.0:
            raise UntranslatableError(f"the box '{box}' is below the floor")
        boxes.append(
            {
                "pos": [x, y],
                "size": [length, width, top],
                "max_speed": round(speed / STEP, 9),
                "first_turn": first,
                "turn_every": 2.0 * first if name == "maze" else first,
            }
        )
    return boxes


def read_walls(file: Path, place: complex) -> Iterator[dict[str, Any]]:
    """Yield the walls of an SDF model, all of which must be boxes on the floor."""
    for shape in _shapes(file, place):
        length, thickness, height = shape.size
        if abs(shape.height - height / 2.0) > 1e-3:
            raise UntranslatableError(f"a wall in {file} is not on the floor")
        yield {
            "centre": [round(shape.centre.real, 6), round(shape.centre.imag, 6)],
            "length": length,
            "along": round(float(np.degrees(shape.yaw)), 6),
            "thickness": thickness,
            "height": height,
        }


@dataclass(frozen=True)
class _Shape:
    """A box of an SDF model.

    Attributes:
        centre: Horizontal position x + iy as a complex number [m].
        height: Height z of the box's center [m].
        yaw: Rotation about the vertical axis [rad].
        size: Edge lengths along x, y and z [m].
    """

    centre: complex
    height: float
    yaw: float
    size: tuple[float, float, float]


def _shapes(file: Path, place: complex, with_pose: bool = True) -> Iterator[_Shape]:
    """Yield the collision shapes of an SDF model.

    Args:
        file: The SDF file.
        place: Horizontal position x + iy at which the model is spawned, as a complex number [m].
        with_pose: Whether to apply the model's own pose, which has no effect if each episode places the model.
    """
    model = parse_xml(read_bytes(file), file).child("model")
    if model is None:
        raise UntranslatableError(f"{file} has no <model>")
    above = [model] if with_pose else []
    for link in model.children("link"):
        for collision in link.children("collision"):
            centre, height, yaw = place, 0.0, 0.0
            for element in (*above, link, collision):
                x, y, z, roll, pitch, turn = _numbers(element, "pose", 6)
                if abs(roll) > 1e-6 or abs(pitch) > 1e-6:
                    raise UntranslatableError(f"a part of {file} is tilted")
                centre += complex(x, y) * np.exp(1j * yaw)
                height, yaw = height + z, yaw + turn
            size = _numbers(collision, "geometry/box/size", 3)
            if not all(size):
                raise UntranslatableError(f"a part of {file} is not a box")
            yield _Shape(complex(centre), height, yaw, (size[0], size[1], size[2]))


def _numbers(element: Element, path: str, count: int) -> list[float]:
    words = (element.findtext(path) or "").split() or ["0"] * count
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count:
        raise UntranslatableError(f"{element.file}: <{path}> does not have {count} numbers")
    return values


def _spawned(package: OldPackage) -> Iterator[tuple[str, tuple[Path, complex]]]:
    """Yield the name, the SDF file and the position x + iy [m] of each model that the constructor spawns."""
    files = {}
    constructor = package.lineage[0].methods["__init__"]
    for node in ast.walk(constructor):
        if isinstance(node, ast.Assign) and (calls := list(_calls(node, "urdf_parse_from_pkg"))):
            name, file = (_text(argument) for argument in calls[0].args[:2])
            folder = next((_text(keyword.value) for keyword in calls[0].keywords if keyword.arg == "folder"), "/urdf")
            paths = Packages({package.name: package.folder}, package.folder.absolute() / "package.xml")
            files[ast.unparse(node.targets[0])] = Path(paths.find(name)) / folder.strip("/") / file
    for call in _calls(constructor, "gazebo_spawn_sdf_string"):
        model = next((_text(keyword.value) for keyword in call.keywords if keyword.arg == "model_name"), "")
        x, y, z = _position(call)
        if z:
            raise UntranslatableError(f"the model '{model}' is spawned above the floor")
        yield model, (files[ast.unparse(call.args[0])], complex(x, y))


def _calls(node: ast.AST, function: str) -> Iterator[ast.Call]:
    calls = [each for each in ast.walk(node) if isinstance(each, ast.Call)
             and ast.unparse(each.func).rpartition(".")[2] == function]  # fmt: skip
    return iter(sorted(calls, key=lambda call: call.lineno))


def _position(call: ast.Call) -> tuple[float, float, float]:
    """Return the literal arguments ``pos_x``, ``pos_y`` and ``pos_z`` of a call [m]."""
    given = {keyword.arg: keyword.value for keyword in call.keywords}
    x, y, z = (float(ast.literal_eval(given[key])) if key in given else 0.0 for key in ("pos_x", "pos_y", "pos_z"))
    return x, y, z


def _text(node: ast.expr) -> str:
    try:
        return str(ast.literal_eval(node))
    except ValueError as error:
        raise UntranslatableError(f"{ast.unparse(node)} is not a literal") from error

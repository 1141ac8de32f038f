"""Meshes of objects for tests of the manipulation tasks, in meters."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import trimesh


def bracket() -> Any:
    """Return an L bracket of two plates, 60 × 30 × 40 mm, that stands on one of them."""
    base = trimesh.creation.box((0.06, 0.03, 0.008))
    wall = trimesh.creation.box((0.008, 0.0298, 0.04))
    base.apply_translation((0.0, 0.0, 0.004))
    wall.apply_translation((-0.0259, 0.0, 0.0281))
    return trimesh.util.concatenate([base, wall])


def bottle() -> Any:
    """Return a bottle with a neck, 40 mm wide and 110 mm high."""
    outline = [(0.0, 0.0), (0.02, 0.0), (0.02, 0.07), (0.01, 0.09), (0.01, 0.11), (0.0, 0.11)]
    return trimesh.creation.revolve(np.array(outline), sections=24)


def ring(inner: float, outer: float, height: float, sections: int) -> list[Any]:
    """Return convex sectors of a ring with a vertical axis, which are 0.2 mm apart."""
    turns = 2.0 * np.pi / sections
    corners = [(r, y, z) for r in (inner, outer) for y in (-1.0, 1.0) for z in (0.0, height)]
    parts = []
    for section in range(sections):
        half = np.tan(turns / 2)
        points = np.array([(r, y * (r * half - 1e-4), z) for r, y, z in corners])
        parts.append(trimesh.convex.convex_hull(points))
        parts[-1].apply_transform(trimesh.transformations.rotation_matrix(section * turns, (0, 0, 1)))
    return parts


def nut() -> Any:
    """Return a hexagonal nut, 30 mm wide and 12 mm high, with a hole."""
    return trimesh.util.concatenate(ring(0.008, 0.015, 0.012, sections=6))


def mug() -> Any:
    """Return a mug with a handle, 60 mm wide and 70 mm high."""
    bottom = trimesh.creation.cylinder(0.0255, 0.004, sections=16)
    bottom.apply_translation((0.0, 0.0, 0.002))
    parts = [*ring(0.026, 0.03, 0.07, sections=16), bottom]
    for size, pos in (
        ((0.02, 0.01, 0.008), (0.0405, 0.0, 0.05)),
        ((0.02, 0.01, 0.008), (0.0405, 0.0, 0.02)),
        ((0.008, 0.0099, 0.0378), (0.0548, 0.0, 0.035)),
    ):
        parts.append(trimesh.creation.box(size))
        parts[-1].apply_translation(pos)
    return trimesh.util.concatenate(parts)


def banana() -> Any:
    """Return a banana: an arc of 120 mm, at most 30 mm thick and pointed at both ends."""
    turns, around = np.radians(np.linspace(-50.0, 50.0, 13)), np.radians(np.arange(0.0, 360.0, 45.0))
    thick = 0.004 + 0.011 * np.cos(turns * 90.0 / 55.0)
    rings = [
        np.stack(
            [
                (0.07 + r * np.cos(around)) * np.cos(turn),
                (0.07 + r * np.cos(around)) * np.sin(turn),
                r * np.sin(around),
            ],
            axis=1,
        )
        for turn, r in zip(turns, thick, strict=True)
    ]
    parts = [trimesh.convex.convex_hull(np.concatenate([first, second])) for first, second in pairwise(rings)]
    for part in parts:
        part.apply_transform(trimesh.transformations.scale_matrix(0.999, part.center_mass))
    return trimesh.util.concatenate(parts)


MADE: dict[str, Callable[[], Any]] = {"bracket": bracket, "bottle": bottle, "nut": nut, "mug": mug, "banana": banana}


def write(name: str, folder: Path, *, scale: float = 1.0) -> Path:
    """Write one of the meshes as an STL file and return the file's path."""
    mesh = MADE[name]()
    mesh.apply_scale(scale)
    path = folder / f"{name}.stl"
    mesh.export(path)
    return path

"""Draws what each camera of an environment sees."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from frobs_core.description import Camera
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.files import write_aside
from frobs_devkit.robot_sheet.sheet import png_classes

_SIDE, _MARGIN, _TITLE, _HEAD = 400, 24, 64, 72  # [pixels]
_MOST = 4  # cameras in a row
_SMALL = (64, 64)  # [pixels] size of the picture for a policy, unless the observation contains a picture of the camera
_DPI = 100


def draw_camera_sheet(id: str, keywords: Mapping[str, Any], path: Path | str) -> Path:
    """Draw what each camera sees after the first reset, above the picture that a policy would get, as one PNG image.

    Raises ConfigurationError if the environment has no camera.
    """
    target = Path(path)
    figure_class, canvas_class = png_classes("cameras", target)
    with closing(gym.make(id, **keywords)) as env:
        env.reset(seed=0)
        base: Any = env.unwrapped
        simulation = base.simulation
        cameras: Mapping[str, Camera] = simulation.scene.cameras
        if not cameras:
            raise ConfigurationError(f"{id} has no camera; add one with the keyword 'cameras'.")
        observed = {
            term.view["camera"]: (term.low.shape[:2], "rgb", base.task.markers() if term.view["markers"] else ())
            for term in base.observations.terms.values()
            if term.view is not None
        }
        tiles = [
            (
                name,
                _facts(camera),
                simulation.render(None, name, (_SIDE, _SIDE))[0],
                simulation.render(None, name, *observed.get(name, (_SMALL,)), fast=True)[0],
            )
            for name, camera in cameras.items()
        ]
    columns = min(_MOST, len(tiles))
    rows, block = -(-len(tiles) // columns), 2 * (_SIDE + _TITLE)
    width, height = columns * (_SIDE + _MARGIN) + _MARGIN, _HEAD + rows * block + _MARGIN
    figure = figure_class(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor="#ffffff")
    canvas_class(figure)  # the canvas registers itself with the figure

    def write(x: int, y: int, text: str, size: float, **style: Any) -> None:
        figure.text(x / width, 1.0 - y / height, text, fontsize=size, va="center", parse_math=False, **style)

    write(_MARGIN, 40, id, 18, weight="bold")
    for number, (name, facts, large, small) in enumerate(tiles):
        row, column = divmod(number, columns)
        x, y = _MARGIN + column * (_SIDE + _MARGIN), _HEAD + row * block
        write(x, y + 20, name, 13, weight="bold")
        write(x, y + 44, facts, 10, color="#6b737c")
        below = y + _TITLE + _SIDE
        write(x, below + 32, f"for a policy, {small.shape[1]} × {small.shape[0]} pixels", 10, color="#6b737c")
        for picture, top in ((large, y + _TITLE), (_enlarged(small), below + _TITLE)):
            figure.figimage(picture[::-1], x, height - top - len(picture), origin="lower")
    target.parent.mkdir(parents=True, exist_ok=True)
    write_aside(target, lambda aside: figure.savefig(aside, format="png", dpi=_DPI))
    return target


def _facts(camera: Camera) -> str:
    place = ", ".join(f"{value:.3g}" for value in camera.pos)
    return f"at ({place}) m of {camera.frame or 'the world'}, {camera.fov_y:.3g}° high"


def _enlarged(picture: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return a picture, enlarged so that its pixels can be seen and it fits into a tile."""
    height, width = picture.shape[:2]
    side = max(height, width)
    rows, columns = (
        np.arange(max(1, _SIDE * count // side)) * count // max(1, _SIDE * count // side) for count in (height, width)
    )
    enlarged: np.ndarray[Any, Any] = picture[rows[:, None], columns]
    return enlarged

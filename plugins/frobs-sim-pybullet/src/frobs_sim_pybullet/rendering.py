"""Renders images in software, without OpenGL, and opens Bullet's viewer, which requires OpenGL."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from frobs_core.description import Camera, Marker, Placement, Scene
from frobs_core.util.errors import RenderingUnavailableError
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.bullet import quiet
from frobs_sim_pybullet.engine import connect
from frobs_sim_pybullet.layout import Arrays
from frobs_sim_pybullet.looks import Looks
from frobs_sim_pybullet.stage import Stage
from frobs_sim_pybullet.transforms import Quat, Vector, rotate

_NEAR, _FAR = 0.01, 50.0  # [m]
_LIGHT = (1.5, -1.5, 3.5)  # position of the light
_DEFAULT = Camera(pos=(1.4, -1.4, 1.1), target=(0.1, 0.0, 0.35))


class Renderer:
    """Renders environments.

    Attributes:
        stage: The rendered world.
    """

    def __init__(self, robots: Mapping[str, Placement], scene: Scene, looks: Looks) -> None:
        self._client, self._looks = connect(), looks
        self.stage = Stage(self._client, robots, scene)

    def draw(
        self,
        arrays: Arrays,
        env: int,
        sizes: Mapping[str, float],
        camera: str | None,
        frame: tuple[Vector, Quat],
        size: tuple[int, int],
        modality: str,
        markers: Sequence[Marker],
        fast: bool,
    ) -> np.ndarray[Any, Any]:
        """Return an image of one environment, (h, w, c), in the format of ``Simulation.render``."""
        self.stage.pose(arrays, env, sizes)
        self.stage.mark(markers if modality == "rgb" else (), env)
        self.stage.paint(self._looks.colors(env))
        height, width = size
        described = _DEFAULT if camera is None else self._looks.camera(camera, env)
        ambient, diffuse = self._looks.light(env)
        view, projection = _view(described, frame), _projection(described, width, height)
        flags = p.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX
        if modality != "segmentation":
            flags |= p.ER_NO_SEGMENTATION_MASK
        _, _, rgb, depth, segments = p.getCameraImage(
            width,
            height,
            view,
            projection,
            lightDirection=_LIGHT,
            lightAmbientCoeff=ambient,
            lightDiffuseCoeff=diffuse,
            shadow=int(modality == "rgb" and not fast),
            renderer=p.ER_TINY_RENDERER,
            flags=flags,
            physicsClientId=self._client,
        )
        match modality:
            case "rgb":
                picture = np.reshape(np.asarray(rgb, np.uint8), (height, width, 4))[..., :3].copy()
                sky = self._looks.sky_color(env)
                if sky is not None:
                    picture[np.reshape(np.asarray(depth), (height, width)) >= 1.0] = sky
                return picture
            case "depth":
                share = np.reshape(np.asarray(depth, np.float64), (height, width, 1))
                return (_FAR * _NEAR / (_FAR - (_FAR - _NEAR) * share)).astype(np.float32)
        return self._segments(np.reshape(np.asarray(segments, np.int64), (height, width, 1)))

    def _segments(self, coded: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Convert Bullet's pixel codes, body + (link + 1) << 24, to segmentation IDs."""
        result = np.full(coded.shape, -1, np.int32)
        for code in np.unique(coded[coded >= 0]).tolist():
            result[coded == code] = self.stage.numbers.get((code & ((1 << 24) - 1), (code >> 24) - 1), -1)
        return result

    def close(self) -> None:
        """Release the rendered world."""
        p.disconnect(self._client)


class Viewer:
    """A window that shows the first environment.

    Raises:
        RenderingUnavailableError: There is no display, or OpenGL is not available.
    """

    def __init__(self, robots: Mapping[str, Placement], scene: Scene, looks: Looks) -> None:
        if sys.platform == "linux" and not os.environ.get("DISPLAY"):
            raise RenderingUnavailableError(
                "there is no display for a window", "xvfb, and start the program with xvfb-run"
            )
        with quiet():
            self._client = p.connect(p.GUI)
        if self._client < 0:
            raise RenderingUnavailableError("Bullet cannot open its window, which requires OpenGL 3", "libgl1-mesa-dri")
        p.configureDebugVisualizer(p.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        self._stage, self._looks = Stage(self._client, robots, scene), looks
        camera = next(iter(scene.cameras.values()), _DEFAULT)
        if camera.frame is None:
            offset = np.subtract(camera.pos, camera.target)
            distance = float(np.linalg.norm(offset))
            yaw = float(np.degrees(np.arctan2(offset[0], -offset[1])))
            pitch = -float(np.degrees(np.arcsin(offset[2] / distance)))
            p.resetDebugVisualizerCamera(distance, yaw, pitch, camera.target, self._client)

    def sync(self, arrays: Arrays, sizes: Mapping[str, float]) -> None:
        """Show the current state, unless the window has been closed."""
        if p.isConnected(self._client):
            p.configureDebugVisualizer(p.COV_ENABLE_RENDERING, 0, physicsClientId=self._client)
            self._stage.pose(arrays, 0, sizes)
            self._stage.paint(self._looks.colors(0))
            p.configureDebugVisualizer(p.COV_ENABLE_RENDERING, 1, physicsClientId=self._client)

    def close(self) -> None:
        """Close the window."""
        if p.isConnected(self._client):
            p.disconnect(self._client)


def _view(camera: Camera, frame: tuple[Vector, Quat]) -> list[float]:
    """Return a camera's OpenGL view matrix, in column-major order."""
    pos, quat = frame
    back = np.subtract(camera.pos, camera.target)
    upright = abs(back[2]) <= 0.999 * float(np.linalg.norm(back))
    up = rotate(quat, camera.up or ((0.0, 0.0, 1.0) if upright else (0.0, 1.0, 0.0)))
    eye = np.add(pos, rotate(quat, camera.pos)).tolist()
    target = np.add(pos, rotate(quat, camera.target)).tolist()
    return list(p.computeViewMatrix(eye, target, up))


def _projection(camera: Camera, width: int, height: int) -> list[float]:
    """Return a camera's OpenGL projection matrix, in column-major order.

    Bullet draws what is at the lower left corner of each pixel, so the matrix moves the pixels' centers there.
    """
    if camera.intrinsics is not None:
        matrix = p.computeProjectionMatrix(*(_NEAR * edge for edge in camera.intrinsics.extent), _NEAR, _FAR)
    else:
        matrix = p.computeProjectionMatrixFOV(camera.fov_y, width / height, _NEAR, _FAR)
    return [*matrix[:8], matrix[8] + 1.0 / width, matrix[9] + 1.0 / height, *matrix[10:]]

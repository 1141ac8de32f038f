"""Looks of each environment: colors, light and cameras. Physics ignores them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.description import Camera, Scene
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat, quat_from_axis_angle
from frobs_models import WrittenLooks
from frobs_sim_pybullet.stage import Stage

LIGHT = {"ambient": 0.6, "sun": 0.35}
"""Share of each light in the brightness of a surface, as by default in Bullet."""


class Looks(WrittenLooks):
    """Values of the parameters that change only images."""

    def __init__(self, num_envs: int, scene: Scene, stage: Callable[[], Stage]) -> None:
        super().__init__(num_envs)
        self._scene, self._stage = scene, stage

    def targets(self, name: str) -> Sequence[str]:
        match name:
            case "color":
                return [*self._stage().colors, self.sky]
            case "light":
                return list(LIGHT)
        return [
            camera
            for camera, described in self._scene.cameras.items()
            if name != "camera_fov" or described.intrinsics is None  # intrinsics set the field of view
        ]

    def nominal(self, name: str, target: str) -> Any:
        match name:
            case "color" if target == self.sky:
                return np.ones(3)
            case "color":
                return self._stage().colors[target][0, :3]
            case "light":
                return 1.0
            case "camera_position":
                return self._scene.cameras[target].pos
            case "camera_fov":
                return self._scene.cameras[target].fov_y
        return np.zeros(3)

    def light(self, env: int) -> tuple[float, float]:
        """Return Bullet's coefficients of ambient and diffuse light in an environment."""
        ambient, sun = (min(1.0, share * float(self._of("light", name, env, 1.0))) for name, share in LIGHT.items())
        return ambient, sun

    def colors(self, env: int) -> dict[str, Floats]:
        """Return the colors of bodies that were set in an environment, (3,) each, by target."""
        written = {target: values[env] for (name, target), values in self.values.items() if name == "color"}
        written.pop(self.sky, None)
        return written

    def camera(self, name: str, env: int) -> Camera:
        """Return a camera as it is in an environment."""
        camera = self._scene.cameras[name]
        pos = self._of("camera_position", name, env, camera.pos)
        turn = self._of("camera_rotation", name, env, np.zeros(3))
        fov = self._of("camera_fov", name, env, camera.fov_y)
        ahead, up = np.subtract(camera.target, camera.pos), camera.up
        if np.any(turn):
            angle = float(np.linalg.norm(turn))
            turned = _axes(camera) @ matrix_from_quat(quat_from_axis_angle(turn / angle, angle))
            ahead, up = -turned[:, 2] * np.linalg.norm(ahead), tuple(turned[:, 1].tolist())
        target = tuple(np.add(pos, ahead).tolist())
        return replace(camera, pos=tuple(np.asarray(pos).tolist()), target=target, up=up, fov_y=float(fov))

    def _of(self, name: str, target: str, env: int, otherwise: Any) -> Any:
        values = self.values.get((name, target))
        return otherwise if values is None else values[env]


def _axes(camera: Camera) -> Floats:
    """Return the axes of a camera as columns, (3, 3): x to the right of its pictures, y up, and z back."""
    back = np.subtract(camera.pos, camera.target) / np.linalg.norm(np.subtract(camera.pos, camera.target))
    up = camera.up or ((0.0, 0.0, 1.0) if abs(back[2]) <= 0.999 else (0.0, 1.0, 0.0))
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)

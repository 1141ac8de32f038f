"""Looks of each environment: colors, light, cameras, patterns of the floor and distractors. Physics ignores them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import mujoco
import numpy as np

from frobs_core.util.arrays import Floats
from frobs_models import WrittenLooks
from frobs_sim_mujoco.geoms import ROBOT_GROUPS, VISUAL_GROUP
from frobs_sim_mujoco.scenery import SKY

PATTERNS, DISTRACTORS = 64, 8
"""Maximum number of patterns of the floor, and of distractors."""

_SIDE = 128  # [pixels] of a pattern
_NEAR, _FAR = 0.28, 0.8  # [m] distances of distractors from the middle of the scene
_AWAY = (1.0, 2.0, -100.0)  # [m] place of distractors that are not shown, below the floor
_SHAPES = ((mujoco.mjtGeom.mjGEOM_BOX, 2), (mujoco.mjtGeom.mjGEOM_SPHERE, 0), (mujoco.mjtGeom.mjGEOM_CYLINDER, 1))
"""Shapes of distractors, each with the index of the size that is half its height."""


class Looks(WrittenLooks):
    """Values of the parameters that change only images.

    Args:
        num_envs: ≥ 1.
        build: Function that builds the model with visual shapes.
        middle: Point (x, y) around which distractors lie [m].
    """

    names: ClassVar[Sequence[str]] = (*WrittenLooks.names, "texture", "distractors")
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {
        **WrittenLooks.limits,
        "texture": (0.0, PATTERNS),
        "distractors": (0.0, DISTRACTORS + 0.999_999),
    }

    def __init__(self, num_envs: int, build: Callable[[], mujoco.MjModel], middle: Floats) -> None:
        super().__init__(num_envs)
        self._build, self._middle = build, middle
        self._model: mujoco.MjModel | None = None

    @property
    def needs_scenery(self) -> bool:
        """Whether a parameter was written that needs patterns or distractors in the drawn model."""
        return any(name in ("texture", "distractors") for name, _ in self.values)

    def targets(self, name: str) -> Sequence[str]:
        """Return the targets of a parameter."""
        model = self._shown()
        match name:
            case "color":
                colored = {int(model.geom_bodyid[geom]) for geom in _plain(model)}
                bodies = [model.body(body).name for body in sorted(colored - {0})]
                return [*bodies, *(["floor"] if _floor(model) is not None else []), self.sky]
            case "light":
                return ["ambient", "sun"]
            case "texture":
                return ["floor"] if _floor(model) is not None else []
            case "distractors":
                return [""]
        cameras = list(range(model.ncam))
        if name == "camera_fov":  # intrinsics set the field of view
            cameras = [camera for camera in cameras if not model.cam_sensorsize[camera].any()]
        return [model.camera(camera).name for camera in cameras]

    def adopt_span(self, model: mujoco.MjModel) -> None:
        """Give a model with distractors the clipping planes of the one without them."""
        plain = self._shown()
        model.stat.extent, model.vis.map.zfar = plain.stat.extent, plain.vis.map.zfar

    def _shown(self) -> mujoco.MjModel:
        if self._model is None:
            self._model = self._build()
        return self._model

    def nominal(self, name: str, target: str) -> Any:
        """Return the value of a parameter in the model."""
        model = self._shown()
        match name:
            case "color" if target == self.sky:
                return np.mean(SKY, axis=0)
            case "color" if target == "floor":
                return model.mat_rgba[_floor(model), :3]
            case "color":
                body = model.body(target).id
                return model.geom_rgba[next(geom for geom in _plain(model) if model.geom_bodyid[geom] == body), :3]
            case "camera_position":
                return model.cam_pos[model.camera(target).id]
            case "camera_rotation":
                return np.zeros(3)
            case "camera_fov":
                return model.cam_fovy[model.camera(target).id]
        return 1.0 if name == "light" else 0.0


class Appearance:
    """Gives a drawn model the looks of one environment at a time.

    Args:
        model: The drawn model.
        looks: The looks of all environments.
    """

    def __init__(self, model: mujoco.MjModel, looks: Looks) -> None:
        self._model, self._looks = model, looks
        self._plain = _plain(model)
        self._nominal = {name: getattr(model, name).copy() for name in ("geom_rgba", "cam_quat", "light_diffuse")}
        headlight = model.vis.headlight
        self._ambient = headlight.ambient.copy(), headlight.diffuse.copy()
        self._spare = [geom for geom in range(model.ngeom) if model.geom(geom).name.startswith(SPARE)]
        self._patterns = (
            [model.material(f"{SPARE}{k}").id for k in range(1, PATTERNS + 1)] if _has_patterns(model) else []
        )

    def show(self, env: int) -> None:
        """Change the model to the looks of an environment."""
        model = self._model
        for (name, target), values in self._looks.values.items():
            value = values[env]
            match name:
                case "color" if target == self._looks.sky:
                    pass  # the renderer paints it into the finished picture
                case "color" if target == "floor":
                    floor = _floor(model)
                    for material in {floor, *self._patterns}:
                        model.mat_rgba[material, :3] = value
                case "color":
                    geoms = self._plain[model.geom_bodyid[self._plain] == model.body(target).id]
                    nominal = self._nominal["geom_rgba"][geoms, :3]
                    model.geom_rgba[geoms, :3] = np.clip(nominal + value - nominal[0], 0.0, 1.0)
                case "light" if target == "sun":
                    model.light_diffuse[:] = np.minimum(value * self._nominal["light_diffuse"], 1.0)
                case "light":
                    ambient, diffuse = self._ambient
                    model.vis.headlight.ambient[:] = np.minimum(value * ambient, 1.0)
                    model.vis.headlight.diffuse[:] = np.minimum(value * diffuse, 1.0)
                case "camera_position":
                    model.cam_pos[model.camera(target).id] = value
                case "camera_rotation":
                    camera = model.camera(target).id
                    turn = np.zeros(4)
                    angle = float(np.linalg.norm(value))
                    mujoco.mju_axisAngle2Quat(turn, value / max(angle, 1e-12), angle)
                    mujoco.mju_mulQuat(model.cam_quat[camera], self._nominal["cam_quat"][camera], turn)
                case "camera_fov":
                    model.cam_fovy[model.camera(target).id] = value
                case "texture":
                    number = round(float(value))
                    model.geom_matid[model.geom("floor").id] = (
                        self._patterns[number - 1] if number else model.material("floor").id
                    )
                case "distractors":
                    self._scatter(float(value))

    def _scatter(self, value: float) -> None:
        """Show as many distractors as the whole part of ``value`` says, as its fraction chooses."""
        model, count = self._model, int(value)
        rng = np.random.default_rng(round((value - count) * 2**32))
        for number, geom in enumerate(self._spare):
            if number >= count:
                model.geom_pos[geom] = _AWAY
                continue
            size, angle, distance = rng.uniform(0.015, 0.045, 3), rng.uniform(-np.pi, np.pi), rng.uniform(_NEAR, _FAR)
            shape, vertical = _SHAPES[int(rng.integers(len(_SHAPES)))]
            model.geom_type[geom], model.geom_size[geom] = shape, size
            model.geom_rgba[geom, :3] = rng.uniform(0.0, 1.0, 3)
            model.geom_rbound[geom] = np.linalg.norm(size)
            x, y = self._looks._middle + distance * np.array([np.cos(angle), np.sin(angle)])
            model.geom_pos[geom] = x, y, size[vertical]
            turn = rng.uniform(-np.pi, np.pi) / 2.0
            model.geom_quat[geom] = np.cos(turn), 0.0, 0.0, np.sin(turn)


SPARE = "frobs_spare_"
"""Prefix of the geoms of distractors and of the materials with patterns."""


def add_patterns(spec: mujoco.MjSpec) -> None:
    """Add materials with patterns for the floor, which are made from their numbers."""
    for number in range(1, PATTERNS + 1):
        name = f"{SPARE}{number}"
        texture = spec.add_texture(
            name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=_SIDE, height=_SIDE, nchannel=3
        )
        texture.data = pattern(number).tobytes()
        material = spec.add_material(name=name, texrepeat=(1.0, 1.0), texuniform=True)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def add_distractors(spec: mujoco.MjSpec) -> None:
    """Add geoms that do not collide, below the floor."""
    for number in range(DISTRACTORS):
        spec.worldbody.add_geom(
            name=f"{SPARE}{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=(0.02, 0.02, 0.02),
            pos=_AWAY,
            quat=(0.8, 0.0, 0.0, 0.6),
            contype=0,
            conaffinity=0,
            mass=0.0,
            group=VISUAL_GROUP,
        )


def pattern(number: int) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return the pattern of a number, (side, side, 3): clouds, stripes, squares, dots or a gradient in two colors."""
    rng = np.random.default_rng(number)
    first, second = rng.uniform(0.0, 255.0, (2, 3))
    y, x = np.mgrid[:_SIDE, :_SIDE] / _SIDE
    count = int(rng.integers(2, 9))
    match number % 5:
        case 0:  # clouds: coarse noise, enlarged smoothly and added to finer noise
            share = np.zeros((_SIDE, _SIDE))
            for octave in range(4):
                cells = 2 ** (octave + 2)
                coarse = rng.uniform(-1.0, 1.0, (cells, cells))
                at, share_of = np.divmod(np.arange(_SIDE) * cells / _SIDE, 1.0)
                low, high = at.astype(int), (at.astype(int) + 1) % cells
                rows = coarse[low] * (1.0 - share_of)[:, None] + coarse[high] * share_of[:, None]
                share += (rows[:, low] * (1.0 - share_of) + rows[:, high] * share_of) / 2.0**octave
            share = 0.5 + 0.5 * np.tanh(1.5 * share)
        case 1:
            share = (np.sin(2.0 * np.pi * count * (x if rng.uniform() < 0.5 else y)) > 0.0).astype(float)
        case 2:
            share = ((np.floor(x * count) + np.floor(y * count)) % 2.0).astype(float)
        case 3:
            share = ((x * count % 1.0 - 0.5) ** 2 + (y * count % 1.0 - 0.5) ** 2 < 0.09).astype(float)
        case _:
            share = np.abs(2.0 * x - 1.0)
    mixed: np.ndarray[Any, Any] = first + (second - first) * share[:, :, None]
    return np.asarray(mixed.round(), np.uint8)


def _plain(model: mujoco.MjModel) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return the drawn geoms without a material, except those of the world."""
    is_drawn = ~np.isin(model.geom_group, ROBOT_GROUPS)
    return np.flatnonzero(is_drawn & (model.geom_matid < 0) & (model.geom_bodyid > 0))


def _floor(model: mujoco.MjModel) -> int | None:
    """Return the floor's material, or None without a floor."""
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MATERIAL, "floor")
    return None if number < 0 else number


def _has_patterns(model: mujoco.MjModel) -> bool:
    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MATERIAL, f"{SPARE}1") >= 0)

"""Renders images and opens the viewer. OpenGL is only initialized when the first image is rendered."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.rendering.classic import gl_context

from frobs_core.description import Marker
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RenderingUnavailableError
from frobs_sim_mujoco.geoms import ROBOT_GROUPS

_PROBE = (
    "import sys, importlib, mujoco\n"
    "context = importlib.import_module('mujoco.' + sys.argv[1]).GLContext(8, 8)\n"
    "context.make_current()\n"
    "mujoco.MjrContext(mujoco.MjModel.from_xml_string('<mujoco/>'), 100)\n"
)

_FAST = {"offsamples": 0, "shadowsize": 0, "numslices": 12, "numstacks": 8}
"""Quality settings for fast images: no antialiasing, no shadows, and few triangles for spheres and cylinders."""

_FLAT = np.array([100.0, 100.0, 1e-3])
"""Half-lengths [m] of the box that replaces a plane in fast images."""

_MOST_CONTEXTS = 8  # maximum number of cached contexts, each with its own textures and framebuffer


@lru_cache(maxsize=1)
def _choose_backend() -> str:
    """Return a working OpenGL backend: the backend in ``MUJOCO_GL`` if it is set, otherwise EGL or OSMesa.

    A backend that does not work can crash the process, so each backend is tried in a separate process.
    """
    requested = os.environ.get("MUJOCO_GL", "").lower()
    for backend in [requested] if requested in ("egl", "osmesa", "glfw") else ["egl", "osmesa"]:
        environment = {**os.environ, "MUJOCO_GL": backend}
        environment.pop("PYOPENGL_PLATFORM", None)
        probe = subprocess.run(
            [sys.executable, "-c", _PROBE, backend], env=environment, capture_output=True, timeout=60, check=False
        )
        if probe.returncode == 0:
            return backend
    raise RenderingUnavailableError(
        "OpenGL (EGL or OSMesa) is not available on this machine", "libegl1 libgl1-mesa-dri"
    )


class Drawn:
    """The rendered model, which includes visual shapes and shows the state of one environment at a time.

    Args:
        model: The simulated model with additional visual shapes.
        batch: Batch that contains the states.
        sizes: Size factors of resized scene bodies, (num_envs,) each, by name. The simulation may update this mapping.
    """

    def __init__(self, model: mujoco.MjModel, batch: Batch, sizes: Mapping[str, Floats]) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self._batch, self._sizes = batch, sizes
        self._nominal = {field: getattr(model, field).copy() for field in ("geom_size", "geom_pos", "geom_rbound")}

    def show(self, env: int) -> None:
        """Set the model to the state of an environment."""
        for name, sizes in self._sizes.items():
            geoms = self.model.geom_bodyid == self.model.body(name).id
            for field, nominal in self._nominal.items():
                getattr(self.model, field)[geoms] = sizes[env] * nominal[geoms]
        mujoco.mj_setState(self.model, self.data, self._batch.state[env], mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)


class Renderer:
    """Renders the environments of a batch.

    All images are rendered from the same model. Each combination of image size and quality has its own OpenGL context,
    which is cached.

    Args:
        drawn: The rendered model.

    Raises:
        RenderingUnavailableError: This machine cannot render.
    """

    def __init__(self, drawn: Drawn) -> None:
        self._drawn, self._model = drawn, drawn.model
        if os.environ.get("MUJOCO_GL", "").lower() not in ("egl", "osmesa", "glfw"):
            # MuJoCo selects a backend on import, but this backend may not work, so a working backend is selected here.
            gl_context.GLContext = importlib.import_module(f"mujoco.{_choose_backend()}").GLContext
        self._full = {name: getattr(self._model.vis.quality, name) for name in _FAST}
        self._renderers: dict[tuple[int, int, bool], mujoco.Renderer] = {}
        self._option = mujoco.MjvOption()
        for group in ROBOT_GROUPS:
            self._option.geomgroup[group] = 0

    def _renderer(self, size: tuple[int, int], fast: bool) -> mujoco.Renderer:
        key = (*size, fast)
        if key in self._renderers:
            return self._renderers[key]
        if len(self._renderers) == _MOST_CONTEXTS:
            self._renderers.pop(next(iter(self._renderers))).close()
        visual = self._model.vis  # read when a context is created
        visual.global_.offheight, visual.global_.offwidth = size
        for name, value in (_FAST if fast else self._full).items():
            setattr(visual.quality, name, value)
        try:
            renderer = self._renderers[key] = mujoco.Renderer(self._model, *size)
        except (ImportError, RuntimeError, mujoco.FatalError) as error:
            raise RenderingUnavailableError(f"OpenGL does not start ({error})", "libegl1 libgl1-mesa-dri") from error
        if fast:
            for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
                renderer.scene.flags[flag] = False
        return renderer

    def draw(
        self, env: int, camera: str | None, size: tuple[int, int], modality: str, markers: Sequence[Marker], fast: bool
    ) -> np.ndarray[Any, Any]:
        """Return an image of one environment, (h, w, c). See ``Simulation.render`` for the arguments and the result."""
        self._drawn.show(env)
        renderer = self._renderer(size, fast)
        renderer.update_scene(self._drawn.data, -1 if camera is None else camera, self._option)
        if fast:
            _flatten_planes(renderer.scene)
        match modality:
            case "rgb":
                for marker in markers:
                    _add_marker(renderer.scene, marker, env)
                picture: np.ndarray[Any, Any] = renderer.render()
                return picture
            case "depth":
                renderer.enable_depth_rendering()
                picture = renderer.render()[..., None]
                renderer.disable_depth_rendering()
                return picture
            case _:
                renderer.enable_segmentation_rendering()
                geoms = renderer.render()[..., :1]
                renderer.disable_segmentation_rendering()
                return np.where(geoms < 0, -1, self._model.geom_bodyid[geoms]).astype(np.int32)

    def close(self) -> None:
        """Release the OpenGL contexts."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()


class Viewer:
    """A window that shows the first environment of a batch.

    Args:
        drawn: The rendered model.

    Raises:
        RenderingUnavailableError: There is no display.
    """

    def __init__(self, drawn: Drawn) -> None:
        if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise RenderingUnavailableError(
                "there is no display for a window", "xvfb, and start the program with xvfb-run"
            )
        import mujoco.viewer

        self._drawn = drawn
        self._window = mujoco.viewer.launch_passive(drawn.model, drawn.data, show_left_ui=False, show_right_ui=False)
        for group in ROBOT_GROUPS:
            self._window.opt.geomgroup[group] = 0

    def sync(self) -> None:
        """Show the current state, unless the window has been closed."""
        if self._window.is_running():
            with self._window.lock():
                self._drawn.show(0)
            self._window.sync()

    def close(self) -> None:
        """Close the window."""
        self._window.close()


def _flatten_planes(scene: mujoco.MjvScene) -> None:
    """Replace planes with large flat boxes, which software OpenGL renders twice as fast."""
    for geom in scene.geoms[: scene.ngeom]:
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_BOX, _FLAT
            geom.pos -= _FLAT[2] * geom.mat[:, 2]  # the upper face coincides with the plane


def _add_marker(scene: mujoco.MjvScene, marker: Marker, env: int) -> None:
    if scene.ngeom >= scene.maxgeom:
        return
    mujoco.mjv_initGeom(
        scene.geoms[scene.ngeom],
        mujoco.mjtGeom.mjGEOM_SPHERE,
        np.full(3, marker.radius),
        np.asarray(marker.pos[env], np.float64),
        np.eye(3).reshape(9),
        np.asarray(marker.rgba, np.float32),
    )
    scene.ngeom += 1

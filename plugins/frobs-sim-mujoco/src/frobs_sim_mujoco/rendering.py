"""Renders images and opens the viewer. OpenGL is only initialized when the first image is rendered."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence, Set
from concurrent.futures import ThreadPoolExecutor, wait
from copy import copy
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.rendering.classic import gl_context

from frobs_core.description import Marker
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import RenderingUnavailableError, SimulationError
from frobs_sim_mujoco.geoms import ROBOT_GROUPS
from frobs_sim_mujoco.looks import Appearance, Looks

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

_FEWEST = 4
"""Minimum number of images for each thread."""

_HIDDEN = ROBOT_GROUPS[0]
"""A geom group that is never drawn."""

_MOST_CONTEXTS = 8  # maximum number of cached contexts, each with its own textures and framebuffer


@lru_cache(maxsize=1)
def _choose_backend() -> str:
    """Return a working OpenGL backend: the backend in ``MUJOCO_GL`` if it is set, otherwise EGL or OSMesa.

    A backend that does not work can crash the process or hang, so each backend is tried in a separate process.
    """
    requested = os.environ.get("MUJOCO_GL", "").lower()
    for backend in [requested] if requested in ("egl", "osmesa", "glfw") else ["egl", "osmesa"]:
        environment = {**os.environ, "MUJOCO_GL": backend}
        environment.pop("PYOPENGL_PLATFORM", None)
        command = [sys.executable, "-c", _PROBE, backend]
        try:
            probe = subprocess.run(command, env=environment, capture_output=True, timeout=60, check=False)
        except subprocess.TimeoutExpired:  # some drivers hang
            continue
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
        looks: Looks of all environments.

    Attributes:
        model: The model.
        data: State of the environment that is shown.
        looks: Looks of all environments.
    """

    def __init__(self, model: mujoco.MjModel, batch: Batch, sizes: Mapping[str, Floats], looks: Looks) -> None:
        self._nominal_model, self.looks, model = model, looks, copy(model)
        self._appearance = Appearance(model, looks)
        self.model, self.data = model, mujoco.MjData(model)
        self._batch, self._sizes = batch, sizes
        self._nominal = {field: getattr(model, field).copy() for field in ("geom_size", "geom_pos", "geom_rbound")}

    def copy(self) -> Drawn:
        """Return a copy, for another thread."""
        return Drawn(self._nominal_model, self._batch, self._sizes, self.looks)

    def show(self, env: int) -> None:
        """Set the model to the state of an environment."""
        for name, sizes in self._sizes.items():
            geoms = self.model.geom_bodyid == self.model.body(name).id
            for field, nominal in self._nominal.items():
                getattr(self.model, field)[geoms] = sizes[env] * nominal[geoms]
        self._appearance.show(env)
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
        self._groups = self._model.geom_group.copy()
        # Bodies of the shapes and of the sites, which MJCF files can contain, by type.
        self._owners = {
            int(mujoco.mjtObj.mjOBJ_GEOM): self._model.geom_bodyid,
            int(mujoco.mjtObj.mjOBJ_SITE): self._model.site_bodyid,
        }
        is_infinite = (self._model.geom_size[:, :2] <= 0.0).all(axis=1)
        self._planes = set(
            np.flatnonzero((self._model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & is_infinite).tolist()
        )

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
        view = -1 if camera is None else camera
        self._model.geom_group[:] = self._groups
        renderer.update_scene(self._drawn.data, view, self._option)
        if fast:  # without shadows and reflections, what is out of view does not matter
            self._model.geom_group[~self._is_in_view(renderer.scene, size)] = _HIDDEN
            renderer.update_scene(self._drawn.data, view, self._option)
            _flatten_planes(renderer.scene, self._planes)
        match modality:
            case "rgb":
                for marker in markers:
                    _add_marker(renderer.scene, marker, env)
                sky = self._drawn.looks.sky_color(env)
                renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = sky is None
                picture: np.ndarray[Any, Any] = renderer.render()
                if sky is not None:
                    picture[_is_empty(renderer)] = sky
                return picture
            case "depth":
                renderer.enable_depth_rendering()
                picture = renderer.render()[..., None]
                renderer.disable_depth_rendering()
                return picture
            case _:
                renderer.enable_segmentation_rendering()
                objects, types = np.split(renderer.render(), 2, axis=-1)
                renderer.disable_segmentation_rendering()
                bodies = np.full(objects.shape, -1, np.int32)
                for kind, owners in self._owners.items():
                    bodies[types == kind] = owners[objects[types == kind]]
                return bodies

    def _is_in_view(self, scene: mujoco.MjvScene, size: tuple[int, int]) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Return whether the bounding sphere of each geom touches the view of the scene's camera, (ngeom,)."""
        left_eye, right_eye = scene.camera[0], scene.camera[1]
        camera = mujoco.mjv_averageCamera(left_eye, right_eye)  # MuJoCo draws what is between two eyes
        right, up, forward = axes = np.empty((3, 3))
        up[:], forward[:] = camera.up, camera.forward
        mujoco.mju_cross(right, forward, up)
        low, high, near = float(camera.frustum_bottom), float(camera.frustum_top), float(camera.frustum_near)
        half = float(camera.frustum_width) or 0.5 * (high - low) * size[1] / size[0]
        middle = float(camera.frustum_center)
        sides = np.array(  # normals that point out of the view, (5, 3), in the axes of the camera
            [
                (near, 0.0, -middle - half),
                (-near, 0.0, middle - half),
                (0.0, near, -high),
                (0.0, -near, low),
                (0.0, 0.0, -1.0),
            ]
        )
        lengths = np.sqrt(np.square(sides).sum(axis=1))
        outside = (self._drawn.data.geom_xpos - camera.pos) @ (sides @ axes).T / lengths  # [m]
        radius = self._model.geom_rbound
        return np.asarray((outside.max(axis=1) <= radius) | (radius <= 0.0))  # planes have no end

    def close(self) -> None:
        """Release the OpenGL contexts."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()


class RenderPool:
    """Renders many environments on several threads, each with its own OpenGL contexts.

    The first thread is the caller's.

    Args:
        drawn: The rendered model.
        num_threads: Maximum number of threads, or 0 for one per processor.
        num_envs: Number of environments.

    Raises:
        RenderingUnavailableError: This machine cannot render.
    """

    def __init__(self, drawn: Drawn, num_threads: int, num_envs: int) -> None:
        usable = getattr(os, "sched_getaffinity", lambda _: range(os.cpu_count() or 1))(0)
        num_threads = max(1, min(num_threads or len(usable), num_envs // _FEWEST))
        if num_threads > 1:  # otherwise Mesa draws each image with several threads, which wait for each other
            os.environ.setdefault("LP_NUM_THREADS", "0")
        self._drawn, self._first = drawn, Renderer(drawn)
        self._owner = threading.get_ident()
        self._threads = [ThreadPoolExecutor(1, "render") for _ in range(num_threads - 1)]
        self._others: list[Renderer | None] = [None] * len(self._threads)

    def draw(self, envs: Sequence[int], *view: Any) -> list[np.ndarray[Any, Any]]:
        """Return an image of each environment. For the other arguments, see :meth:`Renderer.draw`."""
        count = max(1, min(len(self._threads) + 1, len(envs) // _FEWEST))
        pictures: list[Any] = [None] * len(envs)

        def work(number: int, renderer: Renderer) -> None:
            for place in range(number, len(envs), count):
                pictures[place] = renderer.draw(envs[place], *view)

        def work_elsewhere(number: int) -> None:
            renderer = self._others[number - 1]
            if renderer is None:
                renderer = self._others[number - 1] = Renderer(self._drawn.copy())
            work(number, renderer)

        futures = [
            thread.submit(work_elsewhere, number + 1) for number, thread in enumerate(self._threads[: count - 1])
        ]
        try:
            work(0, self._first)
        except Exception as error:
            if threading.get_ident() == self._owner:
                raise
            raise SimulationError(
                "images can only be rendered in the thread that rendered the first one, because an OpenGL context "
                f"belongs to a thread ({type(error).__name__}); render all images of this simulation in one thread."
            ) from error
        finally:
            wait(futures)
        for future in futures:
            future.result()
        return pictures

    def close(self) -> None:
        """Release the OpenGL contexts, each in its thread."""
        self._first.close()
        for thread, renderer in zip(self._threads, self._others, strict=True):
            if renderer is not None:
                thread.submit(renderer.close).result()
            thread.shutdown()


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


def _is_empty(renderer: mujoco.Renderer) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return the pixels of the last picture in which nothing was drawn, (h, w)."""
    depth = np.empty((renderer.height, renderer.width), np.float32)
    mujoco.mjr_readPixels(None, depth, renderer._rect, renderer._mjr_context)
    return np.asarray(depth[::-1] == 0.0)  # OpenGL's first row is at the bottom, and the farthest depth is 0


def _flatten_planes(scene: mujoco.MjvScene, planes: Set[int]) -> None:
    """Replace the infinite ``planes`` with large flat boxes, which software OpenGL renders twice as fast."""
    count = len(planes)
    for i in range(scene.ngeom):
        if not count:  # the floor is usually the first shape
            return
        geom = scene.geoms[i]
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE and geom.objid in planes:
            count -= 1
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

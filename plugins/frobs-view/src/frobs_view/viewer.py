"""The viewer of an environment in the browser."""

from __future__ import annotations

import logging
import queue
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from frobs_core.contracts import Task, Viewer
from frobs_core.kernel.drawn import drawn_parts, frame_names, frame_poses
from frobs_core.util.errors import FrobsError
from frobs_view.drawing import Drawing
from frobs_view.overlays import Contacts, Curves, Markers, Pictures, Trail
from frobs_view.server import ViewServer

RATE = 30.0
"""Maximum number of updates per second."""

SLOW = 0.25
"""Time between two updates of curves and camera pictures [s]."""

_DISTANCE = 1.5
"""Distance from which a new client looks at the scene, relative to the scene's first camera."""

_NO_CAMERA = "none"
_log = logging.getLogger("frobs")


class BrowserViewer(Viewer):
    """Shows an environment in the browser, from the models of its robots and the poses of their links.

    The page can be opened, closed and opened again at any time. Without a page, no poses are read. Actions on the page
    are stored in a queue, which the thread of the environment empties in :meth:`update`.

    Args:
        server: Server to use. By default, a server for this machine is started, and its address is logged.

    Attributes:
        server: The server.
        row: Index of the environment that is shown.
        updates: Number of updates that were sent.
    """

    def __init__(self, server: ViewServer | None = None) -> None:
        self._is_announced = server is not None
        self.server = server or ViewServer()
        self.row, self.updates = 0, 0
        self._events: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._due = self._slow_due = 0.0
        self._steps = 0

    @property
    def address(self) -> str:
        """Address to open in a browser."""
        return self.server.address

    def bind(self, env: Any) -> None:
        """Draw the environment, and begin to collect its reward terms.

        Raises:
            ModelFileError: A mesh cannot be read.
        """
        self.env = env
        try:
            self._draw()
        except BaseException:
            self.server.close()
            raise
        env.after_step.append(self._collect)
        env.after_reset.append(self._begin)
        if not self._is_announced:
            _log.warning("Open %s in a browser to see the environment.", self.address)

    def _draw(self) -> None:
        scene, gui, env = self.server.scene, self.server.gui, self.env
        self.drawing = Drawing(scene, frame_names(env), drawn_parts(env))
        if env.scene.floor:
            size = max(4.0, 2.0 * env.scene.span)  # [m]
            cell = 0.1 if size < 10.0 else 0.5
            scene.add_grid("/floor", width=size, height=size, plane="xy", cell_size=cell, section_size=5.0 * cell)
        self._aim()
        self._markers = Markers(scene, env)
        self._trail = Trail(scene, env)
        self._contacts = None
        if env.simulation.contacts is not None and env.simulation.contacts.scene.contacts:
            self._contacts = Contacts(scene, env, self.drawing)
        self._goal = self._add_goal(scene)
        with gui.add_folder("View") as folder:
            self._add_controls(gui, folder)
        self._curves = Curves(gui, gui.add_folder("Reward"), "reward terms and success")

    def _aim(self) -> None:
        """Aim the camera of new clients like the first fixed camera of the scene, from farther away."""
        camera = next((each for each in self.env.scene.cameras.values() if each.frame is None), None)
        if camera is not None:
            initial = self.server.initial_camera
            place, target = np.array(camera.pos), np.array(camera.target)
            initial.position, initial.look_at = target + _DISTANCE * (place - target), target
            initial.fov = float(np.radians(camera.fov_y))

    def _add_goal(self, scene: Any) -> Any:
        """Return a handle with which the goal can be dragged, or None if the task has no such goal."""
        if type(self.env.task).set_goal is Task.set_goal or self._goal_marker() is None:
            return None
        size = 0.2 * max(1.0, 0.2 * self.env.scene.span)  # [m]
        handle = scene.add_transform_controls("/goal", scale=size, disable_rotations=True, depth_test=False)

        async def drag(event: Any) -> None:  # asynchronous, so that the order of the events is kept
            place = np.array(event.target.position, float)
            self.call(lambda: self._move_goal(place))

        handle.on_update(drag)
        return handle

    def _add_controls(self, gui: Any, folder: Any) -> None:
        simulation = self.env.simulation
        if simulation.num_envs > 1:
            chosen = gui.add_slider("environment", min=0, max=simulation.num_envs - 1, step=1, initial_value=0)
            chosen.on_update(self.queued(lambda: self.show(int(chosen.value))))
        self._trail_box = self._add_toggle(gui, "trail", lambda on: None if on else self._trail.hide())
        self._add_toggle(gui, "frames", lambda on: self.drawing.show_frames(on))
        self._add_toggle(gui, "collision shapes", lambda on: self.drawing.show_collisions(on))
        if self._contacts is not None:
            contacts = self._contacts
            self._contacts_box = self._add_toggle(gui, "contact forces", lambda on: None if on else contacts.hide())
        self._pictures = Pictures(gui, folder, self.env, self.notify)
        cameras = gui.add_dropdown("camera", (_NO_CAMERA, *self.env.scene.cameras), initial_value=_NO_CAMERA)
        cameras.on_update(
            self.queued(lambda: self._pictures.choose("" if cameras.value == _NO_CAMERA else cameras.value))
        )

    def _add_toggle(self, gui: Any, label: str, switch: Callable[[bool], object]) -> Any:
        box = gui.add_checkbox(label, initial_value=False)
        box.on_update(self.queued(lambda: switch(bool(box.value))))
        return box

    def queued(self, function: Callable[[], object]) -> Callable[[Any], None]:
        """Return a callback for the page that lets the thread of the environment call a function."""
        return lambda event: self.call(function)

    def call(self, function: Callable[[], object]) -> None:
        """Let the thread of the environment call a function at the next update."""
        self._events.put(function)

    def notify(self, text: str) -> None:
        """Show ``text`` on all pages."""
        for client in self.server.clients().values():
            client.add_notification("FRobs", text, auto_close_seconds=8.0)

    def poll(self) -> None:
        """Do what people asked for on the page. Errors are shown there."""
        while not self._events.empty():
            function = self._events.get_nowait()
            try:
                function()
            except FrobsError as error:
                self.notify(str(error))

    def show(self, row: int) -> None:
        """Show environment ``row``."""
        self.row = min(max(row, 0), self.env.simulation.num_envs - 1)
        self._trail.hide()
        self.refresh()

    def update(self) -> None:
        """Show the current state, at most 30 times a second and only if a page is open."""
        self.poll()
        now = time.monotonic()
        if now < self._due or not self.server.has_clients:
            return
        self._due = max(self._due + 1.0 / RATE, now)  # on time on average, although steps are not
        self.refresh()
        if now >= self._slow_due:
            self._slow_due = now + SLOW
            self._curves.draw()
            self._pictures.draw(self.row)

    def refresh(self) -> None:
        """Show the current state now."""
        with self.server.together():
            self._refresh()
        self.updates += 1

    def _refresh(self) -> None:
        self.drawing.update(*frame_poses(self.env, self.row))
        self._markers.update(self.row)
        if self._goal is not None and (marker := self._goal_marker()) is not None:
            place = marker.pos[self.row]
            if np.abs(np.asarray(self._goal.position) - place).max() > 1e-6:
                self._goal.position = place
        if self._trail_box.value:
            self._trail.update(self.row)
        if self._contacts is not None and self._contacts_box.value:
            self._contacts.update(self.row)

    def _goal_marker(self) -> Any:
        return next((marker for marker in self.env.task.markers() if marker.name == "goal"), None)

    def _move_goal(self, place: Any) -> None:
        if not np.isfinite(place).all():
            return
        mask = np.arange(self.env.simulation.num_envs) == self.row
        self.env.task.set_goal(place[None], mask)

    def _begin(self, mask: Any) -> None:
        """Begin a new trail when an episode begins."""
        if mask is None or mask[self.row]:
            self._trail.hide()

    def _collect(self, result: Any) -> None:
        """Store the reward terms of a step."""
        if not self.server.has_clients:
            return
        info, row = result[4], self.row
        self._steps += 1
        terms = {name.removeprefix("frobs/reward/"): each for name, each in info.items() if "frobs/reward/" in name}
        values = {name: float(each[row]) for name, each in terms.items()}
        self._curves.add(float(self._steps), {**values, "success": float(info["is_success"][row])})

    def close(self) -> None:
        """Stop the server."""
        self.server.close()

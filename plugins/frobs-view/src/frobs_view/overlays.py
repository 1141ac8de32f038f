"""Elements that a view shows in addition to the shapes: markers, contacts, the trail of the tool, curves and camera pictures."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from frobs_core.util.errors import FrobsError
from frobs_view.drawing import Drawing

TRAIL = 250
"""Number of positions of the tool in its trail."""

CURVE = 300
"""Number of control steps in a curve."""

_COLORS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf")
_CONTACT_RGB = (220, 30, 60)
_METERS_PER_NEWTON = 0.005
_LONGEST = 0.4
"""Maximum length of the arrow of a force [m]."""

_PICTURE = (240, 320)
"""Height and width of camera pictures [pixels]."""


class Markers:
    """The markers of a task.

    Args:
        scene: Scene of the page.
        env: The environment.
    """

    def __init__(self, scene: Any, env: Any) -> None:
        self._scene, self._env = scene, env
        self._nodes: list[Any] = []
        self._drawn: list[Any] = []

    def update(self, row: int) -> None:
        """Show the markers of environment ``row``."""
        markers = self._env.task.markers()
        if len(markers) != len(self._nodes):
            for node in self._nodes:
                node.remove()
            self._nodes = [self._add(i, marker) for i, marker in enumerate(markers)]
            self._drawn = [None] * len(markers)
        for i, marker in enumerate(markers):
            place = tuple(marker.pos[row].tolist())
            if place != self._drawn[i]:
                self._nodes[i].position = self._drawn[i] = place

    def _add(self, number: int, marker: Any) -> Any:
        red, green, blue, alpha = marker.rgba
        return self._scene.add_icosphere(
            f"/marker{number}",
            radius=marker.radius,
            color=(round(255 * red), round(255 * green), round(255 * blue)),
            opacity=None if alpha >= 1.0 else alpha,
            cast_shadow=False,
            receive_shadow=False,
        )


class Contacts:
    """Points for the contacts that the scene declares, and arrows for their forces.

    The contract of simulations has no contact points, so that a contact is shown at the frame of one of its sides. The
    force of a contact that ignores bodies, such as that of a bumper, is not available.

    Args:
        scene: Scene of the page.
        env: The environment, whose simulator reports contacts.
        drawing: Its drawing, which has the frames.
    """

    def __init__(self, scene: Any, env: Any, drawing: Drawing) -> None:
        self._scene, self._state, self._drawing = scene, env.simulation.contacts, drawing
        tool = f"robot/{env.robot.frame_name('tcp')}"
        declared = self._state.scene.contacts.values()
        self._has_force = [not contact.ignore for contact in declared]
        self._sides = [
            next((side for side in (contact.first, contact.second) if side in drawing.names), tool)
            for contact in declared
        ]
        self._nodes: dict[str, Any] = {}

    def update(self, row: int) -> None:
        """Show the contacts of environment ``row``."""
        points, arrows = [], []
        for i in np.flatnonzero(self._state.closed[row]):
            start = self._drawing.position(self._sides[i])
            if start is None:
                continue
            points.append(start)
            force = _METERS_PER_NEWTON * self._state.resultant[row, i]
            length = float(np.sqrt((force * force).sum()))
            if self._has_force[i] and length > 1e-4:
                arrows.append([start, start + force * min(1.0, _LONGEST / length)])
        self._show("points", self._scene.add_point_cloud, points, {"point_size": 0.03})
        sizes = {"shaft_radius": 0.004, "head_radius": 0.01, "head_length": 0.02}
        self._show("forces", self._scene.add_arrows, arrows, sizes)

    def _show(self, name: str, add: Callable[..., Any], places: list[Any], settings: Mapping[str, float]) -> None:
        if name in self._nodes:
            self._nodes.pop(name).remove()
        if places:
            places_array = np.array(places, np.float32)  # (k, 3), or (k, 2, 3) for arrows
            self._nodes[name] = add(f"/contact_{name}", places_array, colors=_CONTACT_RGB, **settings)

    def hide(self) -> None:
        """Remove the points and arrows."""
        for node in self._nodes.values():
            node.remove()
        self._nodes.clear()


class Trail:
    """The last positions of the tool of the first robot.

    Args:
        scene: Scene of the page.
        env: The environment.
    """

    def __init__(self, scene: Any, env: Any) -> None:
        self._scene, self._env = scene, env
        self._points: deque[Any] = deque(maxlen=TRAIL)
        self._node: Any = None

    def update(self, row: int) -> None:
        """Add the position of the tool in environment ``row``."""
        self._points.append(self._env.robot.frame_pose("tcp")[0][row].astype(np.float32))
        points = np.array(self._points)
        if len(points) < 2:
            return
        segments = np.stack([points[:-1], points[1:]], axis=1)  # (k, 2, 3)
        if self._node is None:
            self._node = self._scene.add_line_segments(
                "/trail", segments, colors=(240, 120, 20), thickness=2.0, thickness_units="screen"
            )
        else:
            self._node.points = segments

    def hide(self) -> None:
        """Remove the trail."""
        self._points.clear()
        if self._node is not None:
            self._node.remove()
            self._node = None


class Curves:
    """Curves of numbers over time, in the panel.

    Args:
        gui: Panel of the page.
        folder: Folder of the panel in which the curves are shown.
        title: Title of the plot.
        length: Number of values in each curve.
    """

    def __init__(self, gui: Any, folder: Any, title: str, length: int = CURVE) -> None:
        self._gui, self._folder, self._title = gui, folder, title
        self._values: deque[tuple[float, Mapping[str, float]]] = deque(maxlen=length)
        self._plot: Any = None
        self._names: tuple[str, ...] = ()

    def add(self, x: float, values: Mapping[str, float]) -> None:
        """Add a value to each curve. They are shown at the next :meth:`draw`."""
        if tuple(values) != self._names:
            self._values.clear()
            self._names = tuple(values)
            if self._plot is not None:
                self._plot.remove()
                self._plot = None
        self._values.append((x, values))

    def draw(self) -> None:
        """Show all values."""
        if len(self._values) < 2:
            return
        data = (
            np.array([x for x, _ in self._values]),
            *(np.array([each[name] for _, each in self._values]) for name in self._names),
        )
        if self._plot is None:
            series = [{"label": "step"}] + [
                {"label": name, "stroke": _COLORS[i % len(_COLORS)], "width": 2} for i, name in enumerate(self._names)
            ]
            scales = {"x": {"time": False, "auto": True}, "y": {"auto": True}}
            with self._folder:
                self._plot = self._gui.add_uplot(
                    data, tuple(series), title=self._title, scales=scales, legend={"show": True}, aspect=1.6
                )
        else:
            self._plot.data = data


class Pictures:
    """The picture of one camera, in the panel.

    Args:
        gui: Panel of the page.
        folder: Folder of the panel in which the picture is shown.
        env: The environment.
        notify: Function that shows a message to the people who look at the page.
    """

    def __init__(self, gui: Any, folder: Any, env: Any, notify: Callable[[str], None]) -> None:
        self._gui, self._folder, self._env, self._notify = gui, folder, env, notify
        self._image: Any = None
        self.camera = ""

    def choose(self, camera: str) -> None:
        """Show a camera, or none if the name is empty."""
        self.camera = camera
        if not camera and self._image is not None:
            self._image.remove()
            self._image = None

    def draw(self, row: int) -> None:
        """Show the picture of the chosen camera in environment ``row``."""
        if not self.camera:
            return
        simulation, mask = self._env.simulation, np.arange(self._env.simulation.num_envs) == row
        try:
            [picture] = simulation.render(mask, self.camera, _PICTURE, "rgb", self._env.task.markers())
        except FrobsError as error:
            self._notify(str(error))
            self.choose("")
            return
        if self._image is None:
            with self._folder:
                self._image = self._gui.add_image(picture, label=self.camera)
        else:
            self._image.image = picture

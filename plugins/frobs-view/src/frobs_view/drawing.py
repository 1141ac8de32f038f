"""Draws shapes in moving frames, and moves only the frames that changed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from viser import _messages as wire

from frobs_core.kernel.drawn import DrawnPart
from frobs_core.util.arrays import Floats
from frobs_view.shapes import triangles

_MOVED = 1e-5
"""Change of a position [m] or of a component of a quaternion below which a frame stays where it is drawn."""

_COLLISION_RGB = (230, 120, 30)
_AXES = 0.15
"""Length of the axes of a frame [m]."""


class Drawing:
    """The shapes of an environment or a robot in the scene of a page.

    Args:
        scene: Scene of a :class:`~frobs_view.server.ViewServer`.
        names: Names of all frames.
        parts: Shapes.

    Attributes:
        names: Names of all frames, in the order of their poses.
        nodes: Node of each frame in the scene.

    Raises:
        ModelFileError: A mesh cannot be read.
    """

    def __init__(self, scene: Any, names: Sequence[str], parts: Sequence[DrawnPart]) -> None:
        self._scene, self._parts = scene, parts
        self.names = tuple(names)
        self.nodes = [
            scene.add_frame(f"/frame{i}", show_axes=False, axes_length=_AXES, axes_radius=0.025 * _AXES)
            for i in range(len(names))
        ]
        self._pos, self._quat = np.zeros((len(names), 3)), np.zeros((len(names), 4))
        self._sent = np.full((len(names), 7), np.inf)  # position and orientation of each frame on the page
        self._shapes = self._draw([part for part in parts if not part.only_collides], "visual")
        self._collisions: list[Any] | None = None

    def _draw(self, parts: Sequence[DrawnPart], kind: str) -> list[Any]:
        by_frame: dict[str, list[DrawnPart]] = {}
        for part in parts:
            by_frame.setdefault(part.frame, []).append(part)
        nodes = []
        for frame, shapes in by_frame.items():
            for k, shape in enumerate(triangles(shapes)):
                red, green, blue, alpha = shape.rgba
                color = tuple(round(255 * each) for each in (red, green, blue))
                node = self._scene.add_mesh_simple(
                    f"/frame{self.names.index(frame)}/{kind}{k}",
                    shape.vertices.astype(np.float32),
                    shape.faces,
                    color=_COLLISION_RGB if kind == "collision" else color,
                    opacity=0.5 if kind == "collision" else None if alpha >= 1.0 else alpha,
                    side="double",
                    cast_shadow=False,
                    receive_shadow=False,
                )
                nodes.append(node)
        return nodes

    def update(self, pos: Floats, quat_wxyz: Floats) -> None:
        """Move the frames that are not where they are drawn.

        Args:
            pos: Positions of all frames in the world frame, (k, 3) [m].
            quat_wxyz: Orientations of all frames, (k, 4).
        """
        self._pos[:], self._quat[:] = pos, quat_wxyz
        for node, place, turn in zip(self.nodes, pos, quat_wxyz, strict=True):
            node.position[:], node.wxyz[:] = place, turn
        # These messages are those of the nodes' setters, which spend four times as long on comparing the values.
        changes = np.abs(np.concatenate([self._pos, self._quat], axis=1) - self._sent) > _MOVED
        shifted, turned = changes[:, :3].any(axis=1), changes[:, 3:].any(axis=1)
        send = self._scene._queue_scene_message
        for i in np.flatnonzero(shifted).tolist():
            send(wire.SetPositionMessage(f"/frame{i}", tuple(self._pos[i].tolist())))
        for i in np.flatnonzero(turned).tolist():
            send(wire.SetOrientationMessage(f"/frame{i}", tuple(self._quat[i].tolist())))
        self._sent[shifted, :3], self._sent[turned, 3:] = self._pos[shifted], self._quat[turned]

    def position(self, name: str) -> Floats | None:
        """Return where a frame is drawn, (3,) [m] in the world frame, or None if there is no frame of this name."""
        return self._pos[self.names.index(name)] if name in self.names else None

    def show_frames(self, visible: bool) -> None:
        """Show or hide the axes of all frames."""
        for node in self.nodes:
            node.show_axes = visible

    def show_collisions(self, visible: bool) -> None:
        """Show the collision shapes instead of the visual shapes, or the visual shapes."""
        if visible and self._collisions is None:
            with_visuals = {part.frame for part in self._parts if part.only_collides}
            colliding = [part for part in self._parts if part.only_collides or part.frame not in with_visuals]
            self._collisions = self._draw(colliding, "collision")
        for node in self._shapes:
            node.visible = not visible
        for node in self._collisions or ():
            node.visible = visible

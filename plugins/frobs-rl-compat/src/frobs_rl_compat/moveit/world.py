"""The planning scene of ``move_group``: objects in the world, and objects that the robot carries."""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable
from typing import Any

from frobs_core.models import compose
from frobs_core.util.arrays import Floats
from frobs_rl_compat.moveit import poses
from frobs_rl_compat.moveit import scene as scenes
from frobs_rl_compat.moveit.errors import MoveItCommanderException


class World:
    """The objects in the planning scene of ``move_group``. ``locate`` returns a frame's pose in the planning frame."""

    def __init__(self, robot: str, frame: str, locate: Callable[[str], Floats]) -> None:
        self._robot, self._frame, self._locate = robot, frame, locate
        self._objects: dict[str, Any] = {}
        self._attached: dict[str, Any] = {}
        self._lock = threading.Lock()

    def message(self) -> Any:
        """Return the scene as ``moveit_msgs/PlanningScene``."""
        from moveit_msgs.msg import PlanningScene

        with self._lock:
            scene = PlanningScene(name="(noname)", robot_model_name=self._robot)
            scene.world.collision_objects = list(self._objects.values())
            scene.robot_state.attached_collision_objects = list(self._attached.values())
            return scene

    def apply(self, scene: Any) -> None:
        """Apply either all changes of a ``moveit_msgs/PlanningScene`` or none of them."""
        if scene.world.octomap.octomap.data:
            raise MoveItCommanderException("octomaps are not supported; add boxes or meshes instead.")
        with self._lock:
            before = dict(self._objects), dict(self._attached)
            try:
                if not scene.is_diff:
                    self._objects, self._attached = {}, {}
                for item in scene.robot_state.attached_collision_objects:
                    self._attach_or_detach(item)
                for item in scene.world.collision_objects:
                    self._change(item)
            except MoveItCommanderException:
                self._objects, self._attached = before
                raise

    def _change(self, item: Any) -> None:
        if item.operation == item.REMOVE:
            for name in [item.id] if item.id else list(self._objects):
                self._objects.pop(name, None)
            return
        if not item.id:
            raise MoveItCommanderException("an object must have a name.")
        if item.operation in (item.MOVE, item.APPEND) and item.id not in self._objects:
            raise MoveItCommanderException(f"cannot change the object '{item.id}', because it is not in the scene.")
        placed = self._placed(item)
        if item.operation == item.MOVE:
            known = copy.copy(self._objects[item.id])
            known.pose = placed.pose
            self._objects[item.id] = known
            return
        if item.operation == item.APPEND:
            known = copy.deepcopy(self._objects[item.id])
            scenes.append(known, placed)
            placed = known
        scenes.collisions(placed)
        self._objects[item.id] = placed

    def _attach_or_detach(self, item: Any) -> None:
        name = item.object.id
        if item.object.operation == item.object.REMOVE:
            for candidate in [name] if name else list(self._attached):
                if candidate in self._attached and item.link_name in ("", self._attached[candidate].link_name):
                    self._detach(candidate)
            return
        link = self._locate(item.link_name)
        shaped = item.object.primitives or item.object.meshes or item.object.planes
        if not shaped and name not in self._objects:
            raise MoveItCommanderException(
                f"cannot attach the object '{name}', because it is not in the scene; add the object first, or pass its "
                "shape."
            )
        held = self._placed(item.object) if shaped else copy.copy(self._objects[name])
        held.pose = poses.to_message(compose(poses.inverse(link), poses.from_message(held.pose)))
        held.header.frame_id, held.operation = item.link_name, held.ADD
        scenes.collisions(held)
        attached = copy.copy(item)
        attached.object = held
        self._objects.pop(name, None)
        self._attached[name] = attached

    def _detach(self, name: str) -> None:
        held = self._attached.pop(name)
        freed = copy.copy(held.object)
        freed.pose = poses.to_message(compose(self._locate(held.link_name), poses.from_message(held.object.pose)))
        freed.header = copy.copy(held.object.header)
        freed.header.frame_id = self._frame
        self._objects[name] = freed

    def _placed(self, item: Any) -> Any:
        """Return a copy of an object with its pose expressed in the planning frame."""
        placed = copy.copy(item)
        placed.header = copy.copy(item.header)
        placed.pose = poses.to_message(compose(self._locate(item.header.frame_id), poses.from_message(item.pose)))
        placed.header.frame_id, placed.operation = self._frame, item.ADD
        return placed

"""``PlanningSceneInterface``, which changes the obstacles that motions must avoid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from frobs_rl_compat.moveit import scene as scenes
from frobs_rl_compat.moveit.errors import MoveItCommanderException, NotOfferedError
from frobs_rl_compat.moveit.node import ensure_node
from frobs_rl_compat.moveit.scene_service import apply_scene, current_scene, scene_change, wait_for_move_group

Size = tuple[float, float, float]
_UNIT: Size = (1.0, 1.0, 1.0)


class PlanningSceneInterface:
    """Changes the planning scene of ``move_group``. Each call returns after the scene has changed.

    Args:
        ns: Namespace of ``move_group``.
        synchronous: Ignored, because calls to this replacement are always synchronous.
        service_timeout: Maximum time to wait for ``move_group`` [s].

    Raises:
        MoveItCommanderException: ``move_group`` is not running.
    """

    def __init__(self, ns: str = "", synchronous: bool = False, service_timeout: float = 5.0) -> None:
        del synchronous
        ensure_node()
        self._namespace = ns
        wait_for_move_group(ns, service_timeout)

    def __getattr__(self, name: str) -> Any:
        raise NotOfferedError("PlanningSceneInterface", name, dir(self))

    def add_box(self, name: str, pose: Any, size: Size = _UNIT) -> None:
        """Add a box with the given edge lengths [m] at the pose in a ``PoseStamped``."""
        self.add_object(_primitive(name, pose, "BOX", size))

    def add_sphere(self, name: str, pose: Any, radius: float = 1.0) -> None:
        """Add a sphere with the given radius [m] at the pose in a ``PoseStamped``."""
        self.add_object(_primitive(name, pose, "SPHERE", (radius,)))

    def add_cylinder(self, name: str, pose: Any, height: float, radius: float) -> None:
        """Add a cylinder along z with the given height and radius [m] at the pose in a ``PoseStamped``."""
        self.add_object(_primitive(name, pose, "CYLINDER", (height, radius)))

    def add_mesh(self, name: str, pose: Any, filename: str, size: Size = _UNIT) -> None:
        """Add a mesh from a file, scaled along its axes. Motions avoid the mesh's convex hull."""
        self.add_object(_mesh(name, pose, filename, size))

    def add_object(self, collision_object: Any) -> None:
        """Add, change or remove an object as specified by a ``moveit_msgs/CollisionObject``."""
        if collision_object.operation in (collision_object.ADD, collision_object.APPEND):
            scenes.collisions(collision_object)
        self._apply(objects=[collision_object])

    def remove_world_object(self, name: str | None = None) -> None:
        """Remove an object by name, or all objects if ``name`` is None. Attached objects are kept."""
        from moveit_msgs.msg import CollisionObject

        self._apply(objects=[CollisionObject(id=name or "", operation=CollisionObject.REMOVE)])

    def attach_box(
        self, link: str, name: str, pose: Any = None, size: Size = _UNIT, touch_links: Sequence[str] = ()
    ) -> None:
        """Attach a box to a link. If ``pose`` is None, attach the scene's existing object with this name.

        Args:
            link: The link of the robot to which the box is attached.
            name: Name of the box.
            pose: The pose of a new box as ``PoseStamped``, or None to attach an existing object.
            size: Edge lengths [m].
            touch_links: Links that the box may touch, in addition to ``link``.
        """
        self._attach(link, _existing(name) if pose is None else _primitive(name, pose, "BOX", size), touch_links)

    def attach_mesh(
        self,
        link: str,
        name: str,
        pose: Any = None,
        filename: str = "",
        size: Size = _UNIT,
        touch_links: Sequence[str] = (),
    ) -> None:
        """Attach a mesh to a link. See :meth:`attach_box` for the arguments."""
        self._attach(link, _existing(name) if pose is None else _mesh(name, pose, filename, size), touch_links)

    def attach_object(self, attached_collision_object: Any) -> None:
        """Attach or detach an object as specified by a ``moveit_msgs/AttachedCollisionObject``."""
        self._apply(attached=[attached_collision_object])

    def remove_attached_object(self, link: str | None = None, name: str | None = None) -> None:
        """Detach objects, which remain in the scene at their current poses.

        Args:
            link: Link from which to detach objects. Defaults to all links.
            name: Name of the object to detach. Defaults to all objects.
        """
        from moveit_msgs.msg import AttachedCollisionObject

        item = AttachedCollisionObject(link_name=link or "")
        item.object.id, item.object.operation = name or "", item.object.REMOVE
        self._apply(attached=[item])

    def get_known_object_names(self, with_type: bool = False) -> list[str]:
        """Return the names of all objects in the scene, or only those with a type if ``with_type`` is True."""
        objects = current_scene(self._namespace).world.collision_objects
        return [item.id for item in objects if item.type.key or not with_type]

    def get_objects(self, object_ids: Sequence[str] = ()) -> dict[str, Any]:
        """Return the given objects, or all objects by default, as ``moveit_msgs/CollisionObject`` messages by name."""
        objects = {item.id: item for item in current_scene(self._namespace).world.collision_objects}
        return {name: item for name, item in objects.items() if not object_ids or name in object_ids}

    def get_object_poses(self, object_ids: Sequence[str]) -> dict[str, Any]:
        """Return the poses of objects in the planning frame as ``geometry_msgs/Pose``, by name."""
        return {name: item.pose for name, item in self.get_objects(object_ids).items()} if object_ids else {}

    def get_attached_objects(self, object_ids: Sequence[str] = ()) -> dict[str, Any]:
        """Return the given attached objects, or all by default, as ``moveit_msgs/AttachedCollisionObject`` by name."""
        objects = current_scene(self._namespace).robot_state.attached_collision_objects
        return {item.object.id: item for item in objects if not object_ids or item.object.id in object_ids}

    def clear(self) -> None:
        """Remove all objects, including attached ones."""
        self.remove_attached_object()
        self.remove_world_object()

    def apply_planning_scene(self, planning_scene_message: Any) -> bool:
        """Apply a ``moveit_msgs/PlanningScene`` and return whether ``move_group`` accepted it."""
        return apply_scene(self._namespace, planning_scene_message)

    def _attach(self, link: str, collision_object: Any, touch_links: Sequence[str]) -> None:
        from moveit_msgs.msg import AttachedCollisionObject

        item = AttachedCollisionObject(link_name=link, object=collision_object, touch_links=list(touch_links))
        self._apply(attached=[item])

    def _apply(self, objects: Sequence[Any] = (), attached: Sequence[Any] = ()) -> None:
        if not apply_scene(self._namespace, scene_change(objects, attached)):
            names = ", ".join([item.id for item in objects] + [item.object.id for item in attached]) or "all objects"
            raise MoveItCommanderException(
                f"move_group rejected the change to {names}; see the log of move_group for the reason."
            )


def _existing(name: str) -> Any:
    from moveit_msgs.msg import CollisionObject

    return CollisionObject(id=name, operation=CollisionObject.ADD)


def _placed(name: str, pose: Any) -> Any:
    from moveit_msgs.msg import CollisionObject

    return CollisionObject(header=pose.header, pose=pose.pose, id=name, operation=CollisionObject.ADD)


def _primitive(name: str, pose: Any, kind: str, dimensions: Sequence[float]) -> Any:
    from shape_msgs.msg import SolidPrimitive

    made = _placed(name, pose)
    numbers = [float(length) for length in dimensions]
    made.primitives = [SolidPrimitive(type=getattr(SolidPrimitive, kind), dimensions=numbers)]
    return made


def _mesh(name: str, pose: Any, filename: str, size: Size) -> Any:
    made = _placed(name, pose)
    made.meshes = [scenes.mesh_message(filename, size)]
    return made

"""Describes the contents of a world, in the order that both the plugin and the simulation use."""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

from frobs_core.description import Placement, Scene
from frobs_core.models import home_positions, pose_array
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SceneError
from frobs_sim_gazebo import protocol
from frobs_sim_gazebo.meshes import MeshFiles
from frobs_sim_gazebo.sdf import LINK, body_sdf, floor_sdf, robot_sdf, safe_names
from frobs_sim_gazebo.skeleton import Skeleton

FLOOR = "floor"


class Layout:
    """The models, joints, bodies and shapes of a world.

    Args:
        robots: Robots, by name.
        scene: The rest of the scene.
        meshes: Writer for the mesh files to which the models refer.

    Attributes:
        models: SDF text of each model, by the model's name in Gazebo.
        model_names: Gazebo names of the robots, scene bodies and floor, by kind and original name.
        skeletons: Skeleton of each robot, by name.
        joints: Range of joint indices of each robot, by name.
        bodies: Range of moving-body indices of each robot and each free scene body, by kind and name.
        placed: Names of the kinematic scene bodies.
        joint_count: Total number of joints in all robots.
        body_count: Number of moving bodies, including the bases of robots with a fixed base.
        coms: Center of mass of each moving body in the body's frame, (bodies, 3) [m].
        shapes: Shape indices of each part that contacts may refer to, by the part's name.

    Raises:
        ConfigurationError: The scene is inconsistent or refers to missing objects.
        ModelFileError: A robot cannot be simulated.
    """

    def __init__(self, robots: Mapping[str, Placement], scene: Scene, meshes: MeshFiles) -> None:
        scene.check(robots, lacking=("attachments",))
        self._robots, self._scene = robots, scene
        floor = [FLOOR] if scene.floor else []
        # A robot may have the same name as a body, so the two kinds have separate namespaces.
        keys = (
            [("floor", name) for name in floor] + [("body", n) for n in scene.bodies] + [("robot", n) for n in robots]
        )
        plain = safe_names(f"{kind}.{name}" for kind, name in keys)
        self.model_names = {(kind, name): plain[f"{kind}.{name}"] for kind, name in keys}
        self.models: dict[str, str] = {}
        self.skeletons = {name: Skeleton(placement.model, placement.armatures) for name, placement in robots.items()}
        self.joints: dict[str, slice] = {}
        self.bodies: dict[tuple[str, str], slice] = {}
        self.placed = [name for name, body in scene.bodies.items() if body.kinematic]
        self.joint_count = self.body_count = 0
        self.shapes: dict[str, list[int]] = {}
        self._shape_names: list[tuple[str, str, str]] = []
        coms: list[Floats] = []
        if scene.floor:
            self._add(("floor", FLOOR), floor_sdf(self.model_names["floor", FLOOR], scene.floor_friction))
            self._add_shapes(FLOOR, "floor", FLOOR, LINK, ["0"])
        for name, body in scene.bodies.items():
            if body.rolling_friction > 0.0:
                raise SceneError(
                    f"scene body '{name}'",
                    "has rolling friction, which Gazebo does not support; set rolling_friction to 0.",
                )
            text, shapes = body_sdf(self.model_names["body", name], body, meshes)
            self._add(("body", name), text)
            self._add_shapes(name, "body", name, LINK, shapes)
            if body.inertial is not None:
                self.bodies["body", name] = slice(self.body_count, self.body_count + 1)
                self.body_count += 1
                coms.append(np.array(body.inertial.origin.pos))
        for name, placement in robots.items():
            coms += self._add_robot(name, placement, meshes)
        self.coms = np.array(coms).reshape(self.body_count, 3)

    def _add(self, key: tuple[str, str], text: str) -> None:
        self.models[self.model_names[key]] = text

    def _add_robot(self, name: str, placement: Placement, meshes: MeshFiles) -> list[Floats]:
        bones = self.skeletons[name]
        text, shapes = robot_sdf(self.model_names["robot", name], placement, bones, meshes)
        self._add(("robot", name), text)
        links = safe_names(bones.bodies)
        self.shapes[name] = []
        for link in placement.model.links:
            body = bones.bodies[bones.frames[link.name][0]]
            self._add_shapes(f"{name}/{link.name}", "robot", name, links[body], shapes.get(link.name, []))
            self.shapes[name] += self.shapes[f"{name}/{link.name}"]
        self.joints[name] = slice(self.joint_count, self.joint_count + len(bones.joints))
        self.bodies["robot", name] = slice(self.body_count, self.body_count + len(bones.bodies))
        self.joint_count += len(bones.joints)
        self.body_count += len(bones.bodies)
        coms = [mass.com for mass in bones.masses()]
        if placement.robot.base == "fixed":
            coms[0] = np.zeros(3)
        return coms

    def _add_shapes(self, side: str, kind: str, name: str, link: str, shapes: list[str]) -> None:
        first = len(self._shape_names)
        self.shapes[side] = list(range(first, first + len(shapes)))
        self._shape_names += [(self.model_names[kind, name], link, shape) for shape in shapes]

    def message(self) -> bytes:
        """Return the body of the message that describes the layout to the plugin."""
        parts = [protocol.count(self.joint_count)]
        for name in self._robots:
            bones, model = self.skeletons[name], self.model_names["robot", name]
            names = safe_names(bones.bodies)
            joints = safe_names(joint.name for joint in bones.joints)
            first = self.joints[name].start
            for j, joint in enumerate(bones.joints):
                leader = first + bones.leaders[j] if joint.mimic is not None else -1
                numbers = joint.limits.lower, joint.limits.upper, leader, bones.multipliers[j], bones.offsets[j]
                parts += [
                    protocol.texts(model, joints[joint.name], names[bones.bodies[j + 1]]),
                    struct.pack("<ddidd", *numbers),
                ]
        parts.append(protocol.count(self.body_count))
        for (kind, name), span in self.bodies.items():
            links = [LINK] if kind == "body" else list(safe_names(self.skeletons[name].bodies).values())
            for i in range(span.stop - span.start):
                stands = kind == "robot" and i == 0 and self._robots[name].robot.base == "fixed"
                parts += [protocol.texts(self.model_names[kind, name], links[i]), struct.pack("<B", stands)]
        parts.append(protocol.count(len(self._shape_names)))
        parts += [protocol.texts(*names) for names in self._shape_names]
        parts.append(protocol.count(len(self._scene.contacts)))
        for contact in self._scene.contacts.values():
            everything = list(range(len(self._shape_names)))
            ignored = [shape for side in contact.ignore for shape in self.shapes[side]]
            parts += [
                protocol.indices(everything if contact.first == "*" else self.shapes[contact.first]),
                protocol.indices([] if contact.second == "*" else self.shapes[contact.second]),
                struct.pack("<B", contact.second == "*"),
                protocol.indices(ignored),
            ]
        return b"".join(parts)

    def home(self, robot: str) -> Floats:
        """Return a robot's home positions for all joints, including mimic joints, (joints,) [rad or m]."""
        placement, bones = self._robots[robot], self.skeletons[robot]
        positions: Floats = bones.all_positions(home_positions(placement.model, placement.robot.home)[None])[0]
        return positions

    def start(self, robot: str) -> Floats:
        """Return the initial pose of a robot's base in the scene, (7,)."""
        return pose_array(self._robots[robot].pose)

"""The rendered world, which has visual shapes but no physics, and shows the poses of one environment."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from frobs_core.description import Body, Marker, Placement, Scene
from frobs_core.models import Geometry, Link, Mesh, Pose, Sphere, Visual
from frobs_core.util.arrays import Floats
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.engine import load_urdf
from frobs_sim_pybullet.layout import Arrays
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.shapes import shape_keywords
from frobs_sim_pybullet.transforms import Quat, Vector, compose, from_array, invert
from frobs_sim_pybullet.urdf import skeleton, write_link_urdf, write_urdf

_FLOOR_RGBA = ((0.78, 0.80, 0.82, 1.0), (0.72, 0.74, 0.77, 1.0))
_TILE, _TILES = 0.5, 12  # [m] edge length of a tile, and number of tiles along each axis
# Larger tiles: minimum viewing distance [m], edge length [m], and maximum number per axis
_FAR, _LARGE_TILE, _MOST_TILES = 8.0, 2.0, 40


class Stage:
    """The rendered world.

    Attributes:
        numbers: Segmentation IDs, by Bullet body and link index. The floor has the ID 0.
        colors: Colors of the shapes of each scene body, of each ``robot/link`` that is visible, and of the floor,
            (k, 4).
    """

    def __init__(self, client: int, robots: Mapping[str, Placement], scene: Scene) -> None:
        self.client, self._placements, self._scene = client, robots, scene
        self.numbers: dict[tuple[int, int], int] = {}
        self.colors: dict[str, Floats] = {}
        self._painted: dict[str, Floats] = {}  # colors that differ from those of the scene
        self._shapes: dict[str, list[tuple[int, int, int]]] = {}  # body, link and index of each shape, as in ``colors``
        self._markers: list[int] = []
        if scene.floor:
            for tile in self._floor():
                self.numbers[tile, -1] = 0
                self._list_shapes(tile, {-1: "floor"})
        self._bodies: dict[str, int] = {}
        self._sizes: dict[str, float] = dict.fromkeys(scene.bodies, 1.0)
        meshes = MeshFiles()
        for name, body in scene.bodies.items():
            number = self._bodies[name] = self._add_body(body, meshes)
            self._number(number, -1)
            self._list_shapes(number, {-1: name})
        self._robots = {}
        for name, placement in robots.items():
            floating = placement.robot.base != "fixed"
            text = write_urdf(placement.model, meshes, floating=floating, collisions=False, visuals=True)
            number = load_urdf(text, client, fixed=True, source=str(placement.model.path))
            infos = [p.getJointInfo(number, i, client) for i in range(p.getNumJoints(number, client))]
            for link in (-1, *range(len(infos))):
                self._number(number, link)
            joints = {info[1].decode(): i for i, info in enumerate(infos)}
            links = {-1: f"{name}/{placement.model.root}"}
            self._list_shapes(number, links | {i: f"{name}/{info[12].decode()}" for i, info in enumerate(infos)})
            self._robots[name] = number, joints, skeleton(placement.model, floating=floating).root
        meshes.clear()

    def _number(self, body: int, link: int) -> None:
        self.numbers[body, link] = max(self.numbers.values(), default=0) + 1

    def _list_shapes(self, body: int, targets: Mapping[int, str]) -> None:
        """Note the colors of a Bullet body, whose links have the names ``targets``."""
        index: dict[int, int] = {}
        for _, link, *_, rgba in (shape[:8] for shape in p.getVisualShapeData(body, physicsClientId=self.client)):
            target = targets[link]
            index[link] = index.get(link, -1) + 1
            self._shapes.setdefault(target, []).append((body, link, index[link]))
            self.colors[target] = np.concatenate([self.colors.get(target, np.zeros((0, 4))), [rgba]])

    def paint(self, colors: Mapping[str, Floats]) -> None:
        """Give the first shape of each target a color, (3,), and shift the colors of its other shapes alike.

        All other targets have the colors of the scene.
        """
        for target in {*self._painted, *colors}:
            rgba = self.colors[target]
            rgb = colors.get(target, rgba[0, :3])
            if np.array_equal(rgb, self._painted.get(target, rgba[0, :3])):
                continue
            self._painted[target] = np.array(rgb)
            shifted = np.clip(rgba[:, :3] + rgb - rgba[0, :3], 0.0, 1.0)
            for (body, link, index), color, alpha in zip(self._shapes[target], shifted, rgba[:, 3], strict=True):
                p.changeVisualShape(body, link, index, rgbaColor=[*color.tolist(), alpha], physicsClientId=self.client)

    def _floor(self) -> list[int]:
        """Add a floor of tiles in two colors, and return the tiles' Bullet indices."""
        far = self._scene.span
        tile = _TILE if far < _FAR else _LARGE_TILE
        tiles = _TILES if far < _FAR else min(_MOST_TILES, 2 * math.ceil(far / tile))
        halves = [tile / 2, tile / 2, 0.001]
        shapes = [
            p.createVisualShape(p.GEOM_BOX, halfExtents=halves, rgbaColor=rgba, physicsClientId=self.client)
            for rgba in _FLOOR_RGBA
        ]
        steps = [(i - (tiles - 1) / 2) * tile for i in range(tiles)]
        return [
            p.createMultiBody(0.0, -1, shapes[(i + j) % 2], (x, y, -0.001), physicsClientId=self.client)
            for i, x in enumerate(steps)
            for j, y in enumerate(steps)
        ]

    def _add_body(self, body: Body, meshes: MeshFiles) -> int:
        part = body.parts[0]
        if len(body.parts) == 1 and part.pose == Pose() and not isinstance(part.geometry, Mesh):
            return self._add(part.geometry, body.rgba)
        visuals = tuple(Visual(part.geometry, part.pose, part.rgba) for part in body.parts)
        return load_urdf(write_link_urdf(Link("body", visuals=visuals), meshes, visuals=True), self.client, fixed=True)

    def _add(self, geometry: Geometry, rgba: Sequence[float]) -> int:
        look = {"rgbaColor": list(rgba), "physicsClientId": self.client}
        shape = p.createVisualShape(**shape_keywords(geometry, "length"), **look)
        return int(p.createMultiBody(0.0, -1, shape, physicsClientId=self.client))

    def pose(self, arrays: Arrays, env: int, sizes: Mapping[str, float]) -> None:
        """Move all robots and bodies to their poses in an environment.

        Args:
            arrays: Shared arrays of the simulation, with up-to-date poses of root links and bodies.
            env: Index of the environment.
            sizes: Size factors of resized scene bodies, by name.
        """
        for name, size in self._sizes.items():
            if sizes.get(name, 1.0) != size:
                self._resize(name, sizes.get(name, 1.0))
        for name, number in self._bodies.items():
            self._put(number, from_array(arrays[f"bodies/{name}/pose"][env]))
        for name, (number, joints, root) in self._robots.items():
            model = self._placements[name].model
            positions = dict(zip(model.joint_names, arrays[f"robots/{name}/positions"][env].tolist(), strict=True))
            for joint in model.joints:
                if (leader := model.leader(joint)) is not None:
                    q = leader.multiplier * positions[leader.joint] + leader.offset
                    p.resetJointState(number, joints[joint.name], q, 0.0, self.client)
            com = p.getDynamicsInfo(number, -1, self.client)[3:5]
            base = compose(from_array(arrays[f"robots/{name}/pose/{model.root}"][env]), invert(root))
            p.resetBasePositionAndOrientation(number, *compose(base, com), self.client)

    def _resize(self, name: str, size: float) -> None:
        """Replace a body with a resized copy that has the same segmentation ID."""
        self._sizes[name] = size
        segment = self.numbers.pop((self._bodies[name], -1))
        p.removeBody(self._bodies[name], self.client)
        number = self._bodies[name] = self._add_body(self._scene.bodies[name].resized(size), MeshFiles())
        self.numbers[number, -1] = segment
        self._shapes[name] = [(number, link, index) for _, link, index in self._shapes[name]]
        self._painted.pop(name, None)

    def mark(self, markers: Sequence[Marker], env: int) -> None:
        """Show markers, and remove the markers of the previous call."""
        for number in self._markers:
            p.removeBody(number, self.client)
        self._markers = []
        for marker in markers:
            number = self._add(Sphere(marker.radius), marker.rgba)
            self._put(number, (tuple(np.asarray(marker.pos[env], float).tolist()), (0.0, 0.0, 0.0, 1.0)))
            self._markers.append(number)

    def _put(self, number: int, pose: tuple[Vector, Quat]) -> None:
        p.resetBasePositionAndOrientation(number, *pose, self.client)

"""A URDF as it stands in the file, read without FRobs: by ElementTree, trimesh and Pinocchio."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio
import trimesh

MOVING = ("revolute", "continuous", "prismatic")


@dataclass(eq=False)
class OriginalLink:
    """Mass [kg], centre of mass [m] and inertia [kg·m²] in the link's axes, and the box around what collides [m]."""

    name: str
    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    box: tuple[np.ndarray, np.ndarray] | None


@dataclass(eq=False)
class OriginalJoint:
    """A joint, with NaN where the file gives no number."""

    name: str
    type: str
    child: str
    axis: np.ndarray
    limits: dict[str, float]
    mimic: tuple[str, float, float] | None


class Original:
    """A URDF file.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._boxes: dict[Path, np.ndarray] = {}
        root = ElementTree.fromstring(path.read_bytes().strip())
        self.links = {element.get("name"): self._link(element) for element in root.findall("link")}
        self.joints = {element.get("name"): _joint(element) for element in root.findall("joint")}

    def forward_kinematics(self, positions: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the pose (n, 4, 4) of each link relative to the root link, by Pinocchio.

        Args:
            positions: (n,) of each joint that moves and mimics no other.
        """
        with np.errstate(all="ignore"):
            model = pinocchio.buildModelFromUrdf(str(self.path))
        data = model.createData()
        count = len(next(iter(positions.values()))) if positions else 1
        poses = {link: np.zeros((count, 4, 4)) for link in self.links}
        for row in range(count):
            q = pinocchio.neutral(model)
            for name, joint in self.joints.items():
                if joint.type not in MOVING:
                    continue
                value, place = self._position(joint, positions, row), model.joints[model.getJointId(name)]
                q[place.idx_q : place.idx_q + place.nq] = value if place.nq == 1 else (math.cos(value), math.sin(value))
            pinocchio.framesForwardKinematics(model, data, q)
            for link in self.links:
                poses[link][row] = data.oMf[model.getFrameId(link, pinocchio.FrameType.BODY)].homogeneous
        return poses

    def _position(self, joint: OriginalJoint, positions: dict[str, np.ndarray], row: int) -> float:
        if joint.mimic is None:
            return float(positions[joint.name][row])
        leader, multiplier, offset = joint.mimic
        return multiplier * self._position(self.joints[leader], positions, row) + offset

    def _link(self, element: ElementTree.Element) -> OriginalLink:
        mass, centre, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
        inertial = element.find("inertial")
        if inertial is not None:
            mass = float(inertial.find("mass").get("value")) if inertial.find("mass") is not None else 0.0
            pose = _pose(inertial)
            moments = inertial.find("inertia")
            if moments is not None:
                xx, xy, xz, yy, yz, zz = (float(moments.get(k, 0)) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
                inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            centre, inertia = pose[:3, 3], pose[:3, :3] @ inertia @ pose[:3, :3].T
        corners = [box for collision in element.findall("collision") for box in self._corners(collision)]
        box = (np.min(corners, axis=0), np.max(corners, axis=0)) if corners else None
        return OriginalLink(element.get("name"), mass, centre, inertia, box)

    def _corners(self, collision: ElementTree.Element) -> np.ndarray:
        """Return the two corners of the box around one collision shape, in the link's axes."""
        pose = _pose(collision)
        rotation, origin = pose[:3, :3], pose[:3, 3]
        shape = next(child for child in collision.find("geometry"))
        if shape.tag == "mesh":
            scale = np.array(shape.get("scale", "1 1 1").split(), float)
            points = origin + (self._vertices(shape.get("filename")) * scale) @ rotation.T
            return np.stack([points.min(axis=0), points.max(axis=0)])
        if shape.tag == "box":
            half = np.abs(rotation) @ (0.5 * np.array(shape.get("size").split(), float))
        else:
            radius, along = float(shape.get("radius")), np.abs(rotation[:, 2])
            half = {
                "sphere": lambda: np.full(3, radius),
                "cylinder": lambda: (
                    along * float(shape.get("length")) / 2 + radius * np.sqrt(1 - np.minimum(along, 1) ** 2)
                ),
                "capsule": lambda: along * float(shape.get("length")) / 2 + radius,
            }[shape.tag]()
        return np.stack([origin - half, origin + half])

    def _vertices(self, uri: str) -> np.ndarray:
        if uri.startswith("package://"):
            inside = uri.removeprefix("package://").lstrip("/")
            file = next(folder / inside for folder in self.path.parents if (folder / inside).is_file())
        else:
            file = self.path.parent / uri.removeprefix("file://")
        if file not in self._boxes:
            mesh = trimesh.load(file, force="mesh", process=False)
            self._boxes[file] = np.asarray(mesh.vertices)[np.unique(mesh.faces)]
        return self._boxes[file]


def _joint(element: ElementTree.Element) -> OriginalJoint:
    axis = np.array((element.find("axis").get("xyz") if element.find("axis") is not None else "1 0 0").split(), float)
    limit = element.find("limit")
    limits = {
        key: math.nan if limit is None or limit.get(key) is None else float(limit.get(key))
        for key in ("lower", "upper", "velocity", "effort")
    }
    mimic = element.find("mimic")
    return OriginalJoint(
        name=element.get("name"),
        type=element.get("type"),
        child=element.find("child").get("link"),
        axis=axis / np.linalg.norm(axis) if axis.any() else axis,
        limits=limits,
        mimic=None
        if mimic is None
        else (mimic.get("joint"), float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))),
    )


def _pose(element: ElementTree.Element) -> np.ndarray:
    origin = element.find("origin")
    pose = np.eye(4)
    if origin is not None:
        roll, pitch, yaw = (float(word) for word in origin.get("rpy", "0 0 0").split())
        pose[:3, :3] = pinocchio.rpy.rpyToMatrix(roll, pitch, yaw)
        pose[:3, 3] = [float(word) for word in origin.get("xyz", "0 0 0").split()]
    return pose

"""Publishes what one served robot measures, its description and its frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from frobs_core.contracts import RobotHandle
from frobs_core.description import Camera, ForceTorque, Imu, Lidar
from frobs_core.kernel.env import RobotEnv
from frobs_core.models import JointType
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import quat_conjugate, quat_multiply, quat_rotate, rpy_from_quat
from frobs_models import urdf_of
from frobs_ros2.ros import Node, message_type, optional_type

Transform = tuple[str, str, Floats, Floats]
"""Parent frame, child frame, position (3,) [m] and quat_wxyz (4,) of the child in the parent."""


def robot_description(handle: RobotHandle) -> str:
    """Return the URDF of a robot. If its base is fixed, the root is a link ``world`` at the world's origin."""
    root = urdf_of(handle.model)
    if handle.robot.base == "fixed":
        pos, quat = (each[0] for each in handle.base_pose)
        ET.SubElement(root, "link", {"name": "world"})
        joint = ET.SubElement(root, "joint", {"name": "world_joint", "type": "fixed"})
        numbers = (" ".join(repr(float(value)) for value in row) for row in (pos, rpy_from_quat(quat)))
        ET.SubElement(joint, "origin", dict(zip(("xyz", "rpy"), numbers, strict=True)))
        ET.SubElement(joint, "parent", {"link": "world"})
        ET.SubElement(joint, "child", {"link": handle.model.links[0].name})
    return ET.tostring(root, encoding="unicode")


def transforms(handle: RobotHandle, prefix: str = "", moving: bool = True) -> Iterator[Transform]:
    """Return the transforms between the links of a robot, and from the world to its root.

    Args:
        handle: Handle of the robot.
        prefix: Prefix of its frames.
        moving: Whether to return the transforms that change over time, or else those that do not.
    """
    pos, quat = (each[0] for each in handle.link_poses())
    index = {link.name: i for i, link in enumerate(handle.model.links)}
    root = handle.model.links[0].name
    if moving == (handle.robot.base != "fixed"):
        yield "odom" if moving else "world", f"{prefix}{root}", pos[0], quat[0]
    for joint in handle.model.joints:
        if moving != (joint.type is not JointType.FIXED):
            continue
        parent, child = index[joint.parent], index[joint.child]
        back = quat_conjugate(quat[parent])
        relative = quat_rotate(back, pos[child] - pos[parent]), quat_multiply(back, quat[child])
        yield f"{prefix}{joint.parent}", f"{prefix}{joint.child}", *relative


class Publishers:
    """The topics of one robot.

    Args:
        env: The environment.
        name: Name of the robot in the environment.
        node: Node of the server.
        namespace: Prefix of the robot's topics, empty or ``"name/"``.
    """

    def __init__(self, env: RobotEnv, name: str, node: Node, namespace: str) -> None:
        self._env, self._name, self._namespace = env, name, namespace
        self.handle: RobotHandle = env.simulation.robots[name]
        self._node = node
        self._type = message_type
        self._joints = node.publisher("sensor_msgs/msg/JointState", f"{namespace}joint_states")
        description = node.publisher("std_msgs/msg/String", f"{namespace}robot_description", latched=True)
        description.publish(message_type("std_msgs/msg/String")(data=robot_description(self.handle)))
        self._sensors: list[tuple[Any, Callable[[Any], Any]]] = []
        for sensor, description in self.handle.robot.sensors.items():
            self._add_sensor(sensor, description)
        if self.handle.robot.base != "fixed":
            self._sensors.append((node.publisher("nav_msgs/msg/Odometry", f"{namespace}odom"), self._odometry))
        self._tf: Any = None
        if (kind := optional_type("tf2_msgs/msg/TFMessage", node.log)) is not None:
            self._tf = node.publisher("tf2_msgs/msg/TFMessage", "/tf", depth=100)
            static = node.publisher("tf2_msgs/msg/TFMessage", "/tf_static", latched=True)
            static.publish(kind(transforms=self._stamped(message_type("std_msgs/msg/Header")(), moving=False)))
            self._tf_type = kind

    def publish(self, stamp: Any) -> None:
        """Publish all measurements.

        Args:
            stamp: Time of the measurements, a ``builtin_interfaces/msg/Time``.
        """
        header = self._type("std_msgs/msg/Header")
        handle = self.handle
        if self._tf is not None:
            self._tf.publish(self._tf_type(transforms=self._stamped(header(stamp=stamp), moving=True)))
        for publisher, read in self._sensors:
            if publisher.get_subscription_count():
                publisher.publish(read(stamp))
        self._joints.publish(
            self._type("sensor_msgs/msg/JointState")(
                header=header(stamp=stamp),
                name=list(handle.joint_names),
                position=handle.joint_positions[0].tolist(),
                velocity=handle.joint_velocities[0].tolist(),
                effort=handle.joint_efforts[0].tolist(),
            )
        )

    def _add_sensor(self, name: str, sensor: Any) -> None:
        found: list[tuple[type, str, str, Callable[[str, Any, Any], Any]]] = [
            (Lidar, "scan", "LaserScan", self._scan),
            (Imu, "imu", "Imu", self._imu),
            (ForceTorque, "wrench", "WrenchStamped", self._wrench),
        ]
        for kind, topic, message, read in found:
            if isinstance(sensor, kind):
                same = [one for one in self.handle.robot.sensors.values() if isinstance(one, kind)]
                package = "geometry_msgs" if kind is ForceTorque else "sensor_msgs"
                path = f"{self._namespace}{topic}" if len(same) == 1 else f"{self._namespace}{name}/{topic}"
                publisher = self._node.publisher(f"{package}/msg/{message}", path)
                self._sensors.append((publisher, partial(read, name, sensor)))

    def _read(self, name: str) -> list[float]:
        term = {"type": "sensor", "sensor": name, "robot": self._name}
        values: list[float] = self._env.read_terms({name: term})[name].astype(float).tolist()
        return values

    def _header(self, stamp: Any, frame: str) -> Any:
        return self._type("std_msgs/msg/Header")(stamp=stamp, frame_id=f"{self._namespace}{frame}")

    def _scan(self, name: str, lidar: Any, stamp: Any) -> Any:
        angles = lidar.angles
        return self._type("sensor_msgs/msg/LaserScan")(
            header=self._header(stamp, lidar.frame),
            angle_min=float(angles[0]),
            angle_max=float(angles[-1]),
            angle_increment=float(angles[1] - angles[0]) if len(angles) > 1 else 0.0,
            range_min=float(lidar.range_min),
            range_max=float(lidar.range_max),
            ranges=self._read(name),
        )

    def _imu(self, name: str, imu: Any, stamp: Any) -> Any:
        vector, read = self._type("geometry_msgs/msg/Vector3"), self._read(name)
        w, x, y, z = self.handle.frame_pose(imu.frame)[1][0].tolist()
        return self._type("sensor_msgs/msg/Imu")(
            header=self._header(stamp, imu.frame),
            orientation=self._type("geometry_msgs/msg/Quaternion")(w=w, x=x, y=y, z=z),
            angular_velocity=_xyz(vector, read[:3]),
            linear_acceleration=_xyz(vector, read[3:]),
        )

    def _wrench(self, name: str, sensor: Any, stamp: Any) -> Any:
        vector, read = self._type("geometry_msgs/msg/Vector3"), self._read(name)
        wrench = self._type("geometry_msgs/msg/Wrench")(force=_xyz(vector, read[:3]), torque=_xyz(vector, read[3:]))
        return self._type("geometry_msgs/msg/WrenchStamped")(header=self._header(stamp, sensor.frame), wrench=wrench)

    def _odometry(self, stamp: Any) -> Any:
        pos, quat = (each[0] for each in self.handle.base_pose)
        linear, angular = (each[0] for each in self.handle.base_twist)
        back = quat_conjugate(quat)  # odometry reports the twist in the frame of the base
        message = self._type("nav_msgs/msg/Odometry")(
            header=self._type("std_msgs/msg/Header")(stamp=stamp, frame_id="odom"),
            child_frame_id=f"{self._namespace}{self.handle.model.links[0].name}",
        )
        vector = self._type("geometry_msgs/msg/Vector3")
        message.pose.pose.position = _xyz(self._type("geometry_msgs/msg/Point"), pos)
        message.pose.pose.orientation = _quaternion(quat)
        message.twist.twist.linear = _xyz(vector, quat_rotate(back, linear))
        message.twist.twist.angular = _xyz(vector, quat_rotate(back, angular))
        return message

    def _stamped(self, header: Any, moving: bool) -> list[Any]:
        kind, vector = self._type("geometry_msgs/msg/TransformStamped"), self._type("geometry_msgs/msg/Vector3")
        rows = []
        for parent, child, pos, quat in transforms(self.handle, self._namespace, moving):
            row = kind(child_frame_id=child)
            row.header.stamp, row.header.frame_id = header.stamp, parent
            row.transform.translation, row.transform.rotation = _xyz(vector, pos), _quaternion(quat)
            rows.append(row)
        return rows


class CameraPublisher:
    """Publishes the images of one camera of the scene, and their ``camera_info``.

    Args:
        env: The environment.
        name: Name of the camera.
        size: Height and width of the images [pixels].
        node: Node of the server.
    """

    def __init__(self, env: RobotEnv, name: str, size: tuple[int, int], node: Node) -> None:
        self._env, self._name, self._size = env, name, size
        self._images = node.publisher("sensor_msgs/msg/Image", f"{name}/image_raw", depth=2)
        self._info = node.publisher("sensor_msgs/msg/CameraInfo", f"{name}/camera_info", depth=2)
        self._camera: Camera = env.scene.cameras[name]

    def publish(self, stamp: Any) -> None:
        """Publish an image if anybody listens."""
        if not self._images.get_subscription_count() + self._info.get_subscription_count():
            return
        height, width = self._size
        header = message_type("std_msgs/msg/Header")(stamp=stamp, frame_id=self._name)
        pixels = self._env.simulation.render(None, self._name, self._size, "rgb", fast=True)[0]
        image = message_type("sensor_msgs/msg/Image")(
            header=header, height=height, width=width, encoding="rgb8", step=3 * width
        )
        image.data.frombytes(np.ascontiguousarray(pixels).tobytes())
        self._images.publish(image)
        fx, fy, cx, cy = focal_lengths(self._camera, self._size)
        self._info.publish(
            message_type("sensor_msgs/msg/CameraInfo")(
                header=header, height=height, width=width, distortion_model="plumb_bob", d=[0.0] * 5,
                k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0], r=np.eye(3).ravel().tolist(),
                p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            )
        )  # fmt: skip


def focal_lengths(camera: Camera, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return ``fx``, ``fy``, ``cx`` and ``cy`` of a camera's images [pixels].

    Args:
        camera: The camera.
        size: Height and width of the images [pixels].
    """
    height, width = size
    if (lens := camera.intrinsics) is not None:
        x, y = width / lens.width, height / lens.height
        return lens.fx * x, lens.fy * y, lens.cx * x, lens.cy * y
    f = 0.5 * height / math.tan(0.5 * math.radians(camera.fov_y))
    return f, f, 0.5 * width, 0.5 * height


def _xyz(kind: Any, values: Any) -> Any:
    x, y, z = (float(value) for value in values)
    return kind(x=x, y=y, z=z)


def _quaternion(quat_wxyz: Floats) -> Any:
    w, x, y, z = quat_wxyz.tolist()
    return message_type("geometry_msgs/msg/Quaternion")(w=w, x=x, y=y, z=z)

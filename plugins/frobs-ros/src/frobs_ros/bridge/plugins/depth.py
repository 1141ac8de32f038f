"""Depth-camera plugins, which publish depth images and point clouds in addition to color images.

The plugins are libgazebo_ros_openni_kinect.so and libgazebo_ros_depth_camera.so. Depth is measured along the viewing
direction (z in the optical frame), not along the ray through a pixel. In depth images and point clouds, a pixel is NaN
if nothing is visible at this pixel, or if the depth is not between ``pointCloudCutoff`` and the smaller of
``pointCloudCutoffMax`` and ``<clip><far>``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import Simulation
from frobs_ros.bridge.gazebo_elements import Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.plugins.cameras import CameraTopics, Pixels

_POINT = np.dtype(
    {"names": ["x", "y", "z", "bgr"], "formats": ["<f4", "<f4", "<f4", "3u1"], "offsets": [0, 4, 8, 16], "itemsize": 32}
)
"""Memory layout of a point, which matches gazebo_ros. The color is stored in the lower three bytes of a float32."""


class DepthTopics(CameraTopics):
    """Publisher of color images, depth images (32FC1) [m], their camera_info, and a ``sensor_msgs/PointCloud2``.

    The (height, width) point cloud contains one point per pixel in the optical frame: x right, y down, z forward [m].

    Args:
        space: Namespace of the topics: either empty or beginning with a slash.
        most: Default of ``pointCloudCutoffMax`` [m].

    Raises:
        ConfigurationError: See :class:`CameraTopics`.
    """

    def __init__(self, model: Model, plugin: Plugin, space: str, most: float = math.inf) -> None:
        super().__init__(model, plugin, space)
        self._range = (
            plugin.number("pointCloudCutoff", default=0.4),
            min(plugin.number("pointCloudCutoffMax", default=most), self.optics.far),
        )
        self._depth = self._publisher("depthImageTopicName", "depth/image_raw", "Image")
        self._depth_info = self._publisher("depthImageCameraInfoTopicName", "depth/camera_info", "CameraInfo")
        self._cloud = self._publisher("pointCloudTopicName", "points", "PointCloud2")
        height, width = self.optics.size
        self._right = (np.arange(width) - 0.5 * (width - 1)) / self.optics.focal_length  # (w,) of a point at depth 1
        self._down = (np.arange(height) - 0.5 * (height - 1))[:, None] / self.optics.focal_length  # (h, 1)

    def _send(self, simulation: Simulation, header: Any) -> None:
        super()._send(simulation, header)
        self._send_info(self._depth_info, header)
        wants_cloud = self._cloud.get_num_connections() > 0
        if wants_cloud or self._depth.get_num_connections():
            depth = self._measure(simulation)
            height, width = self.optics.size
            self._depth.publish(self._depth.data_class(header, height, width, "32FC1", 0, 4 * width, depth.tobytes()))
            if wants_cloud:
                self._cloud.publish(self._cloud_message(header, depth, self._draw(simulation, "rgb")))

    def _measure(self, simulation: Simulation) -> npt.NDArray[np.float32]:
        """Return the (h, w) depth of each pixel [m]."""
        depth = self._draw(simulation, "depth")[..., 0]
        nothing = self._draw(simulation, "segmentation")[..., 0] < 0
        least, most = self._range
        return np.where(nothing | (depth <= least) | (depth >= most), np.nan, depth).astype("<f4")

    def _cloud_message(self, header: Any, depth: npt.NDArray[np.float32], colors: Pixels) -> Any:
        from sensor_msgs.msg import PointField

        points = np.zeros(depth.shape, _POINT)
        points["x"], points["y"], points["z"] = depth * self._right, depth * self._down, depth
        points["bgr"] = colors[..., ::-1]
        height, width = depth.shape
        offsets = {"x": 0, "y": 4, "z": 8, "rgb": 16}
        return self._cloud.data_class(
            header=header,
            height=height,
            width=width,
            fields=[PointField(name, offset, PointField.FLOAT32, 1) for name, offset in offsets.items()],
            point_step=_POINT.itemsize,
            row_step=_POINT.itemsize * width,
            data=points.tobytes(),
            is_dense=not np.isnan(depth).any(),
        )

"""The plugin libgazebo_ros_camera.so, which publishes images and camera_info.

The intrinsics match gazebo_ros. For an image of w by h pixels with a horizontal field of view a, the focal length is
f = w / (2 tan(a/2)) in both directions, and the optical center is at ((w + 1)/2, (h + 1)/2). However, images are
rendered with the optical center at ((w - 1)/2, (h - 1)/2), so the center in camera_info is off by one pixel in each
direction, as in Gazebo.

A camera looks along the x axis of the sensor frame, with the z axis up. Images follow the optical convention of ROS
(x right, y down, z forward). ``frameName`` is copied into the message header and does not move the camera.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from frobs_core.contracts import Simulation
from frobs_core.util.errors import RenderingUnavailableError
from frobs_ros.bridge import LOG
from frobs_ros.bridge.camera_optics import CameraOptics, camera_name, read_optics
from frobs_ros.bridge.component import Component
from frobs_ros.bridge.gazebo_elements import CAMERAS, Plugin
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.world import World
from frobs_ros.ros.names import resolve

Pixels = npt.NDArray[np.uint8]

_USUAL_RATE = 30.0  # default rate [Hz], whereas Gazebo renders as fast as possible by default
_LUMA = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601
_DISTORTION = ("distortionK1", "distortionK2", "distortionK3", "distortionT1", "distortionT2")


class CameraTopics(Component):
    """Publisher of a camera's ``sensor_msgs/Image`` and ``sensor_msgs/CameraInfo``, which have the same time stamp.

    Args:
        space: Namespace of the topics: either empty or beginning with a slash.

    Raises:
        ConfigurationError: A parameter is invalid, the plugin does not belong to a camera, or distortion is requested.
    """

    def __init__(self, model: Model, plugin: Plugin, space: str) -> None:
        sensor = plugin.owner("<sensor> that has a <camera>", CAMERAS)
        for name in _DISTORTION:
            if plugin.number(name, default=0.0):
                raise plugin.error(f"lens distortion is not supported; set <{name}> to 0.")
        super().__init__(plugin.lowest_rate("updateRate", 0.0, _USUAL_RATE))
        self._plugin, self._space = plugin, resolve(space, plugin.text("cameraName")).rstrip("/")
        self._camera, self._title = camera_name(model, sensor), f"model '{model.name}': the camera '{sensor.name}'"
        self._frame = plugin.text("frameName", default="world").strip("/")
        self._random = np.random.default_rng(0)
        self.optics: CameraOptics = read_optics(sensor)
        self._image = self._publisher("imageTopicName", "image_raw", "Image")
        self._info = self._publisher("cameraInfoTopicName", "camera_info", "CameraInfo")
        self._intrinsics = _intrinsics(self.optics, plugin)

    def tell(self, world: World) -> None:
        """Render and publish if there are subscribers."""
        if world.simulation is None or not any(publisher.get_num_connections() for publisher in self._topics):
            return
        try:
            self._send(world.simulation, self.header(world, self._frame))
        except RenderingUnavailableError as error:
            LOG.error("%s publishes nothing: %s", self._title, error)
            self.publish_no_more()

    def _send(self, simulation: Simulation, header: Any) -> None:
        """Publish on the topics that have subscribers."""
        if self._image.get_num_connections():
            self._image.publish(self._image_message(header, self._colors(simulation)))
        self._send_info(self._info, header)

    def _send_info(self, publisher: Any, header: Any) -> None:
        if publisher.get_num_connections():
            publisher.publish(publisher.data_class(header=header, **self._intrinsics))

    def _publisher(self, parameter: str, usual: str, kind: str) -> Any:
        name = resolve(self._space, self._plugin.text(parameter, default=usual))
        return self.publisher(name, f"sensor_msgs/{kind}", queue_size=2)

    def _colors(self, simulation: Simulation) -> Pixels:
        """Return an RGB image (h, w, 3)."""
        drawn: Pixels = self._draw(simulation, "rgb")
        mean, deviation = self.optics.noise
        if not (mean or deviation):
            return drawn
        noisy = drawn + 255.0 * self._random.normal(mean, deviation, drawn.shape)
        return np.clip(np.rint(noisy), 0.0, 255.0).astype(np.uint8)

    def _draw(self, simulation: Simulation, modality: str) -> npt.NDArray[Any]:
        drawn: npt.NDArray[Any] = simulation.render(None, self._camera, self.optics.size, modality, fast=True)[0]
        return drawn

    def _image_message(self, header: Any, colors: Pixels) -> Any:
        encoding = self.optics.encoding
        if encoding == "mono8":
            colors = np.rint(colors @ _LUMA).astype(np.uint8)
        elif encoding == "bgr8":
            colors = colors[..., ::-1]
        height, width = self.optics.size
        step = width * (1 if encoding == "mono8" else 3)
        return self._image.data_class(header, height, width, encoding, 0, step, colors.tobytes())


def _intrinsics(optics: CameraOptics, plugin: Plugin) -> dict[str, Any]:
    f, cx, cy = optics.focal_length, 0.5 * (optics.width + 1), 0.5 * (optics.height + 1)
    shift = -f * plugin.number("hackBaseline", default=0.0)
    return {
        "height": optics.height,
        "width": optics.width,
        "distortion_model": "plumb_bob",
        "D": [0.0] * 5,
        "K": [f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [f, 0.0, cx, shift, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }

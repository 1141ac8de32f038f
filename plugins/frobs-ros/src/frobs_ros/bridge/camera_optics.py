"""Optics and poses of the cameras in a model file."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from frobs_core.description import Camera
from frobs_core.util.rotations import quat_rotate
from frobs_ros.bridge.gazebo_elements import SensorElement
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.poses import Place, place_of

ENCODINGS = {
    "R8G8B8": "rgb8",
    "RGB_INT8": "rgb8",
    "B8G8R8": "bgr8",
    "BGR_INT8": "bgr8",
    "L8": "mono8",
    "L_INT8": "mono8",
}
"""Encoding of sensor_msgs/Image for each SDF ``<format>`` value."""
_SIZE = {"width": 320, "height": 240}
_MOST_PIXELS = 8192  # in each direction


@dataclass(frozen=True)
class CameraOptics:
    """Image parameters of a ``<camera>`` element.

    Attributes:
        width: [pixels]
        height: [pixels]
        fov_x: Horizontal field of view [rad].
        far: Distance along the viewing direction beyond which nothing is visible [m].
        encoding: Encoding of sensor_msgs/Image.
        noise: Mean and standard deviation of each color channel's noise, as fractions of full intensity.
    """

    width: int
    height: int
    fov_x: float
    far: float
    encoding: str
    noise: tuple[float, float]

    @property
    def size(self) -> tuple[int, int]:
        """Height and width [pixels]."""
        return self.height, self.width

    @property
    def focal_length(self) -> float:
        """Focal length in both image directions [pixels]."""
        return self.width / (2.0 * math.tan(0.5 * self.fov_x))

    @property
    def fov_y(self) -> float:
        """Vertical field of view [deg]."""
        return math.degrees(2.0 * math.atan(0.5 * self.height / self.focal_length))


def read_optics(sensor: SensorElement) -> CameraOptics:
    """Read a sensor's ``<camera>`` element, using SDF's default values for missing settings.

    Raises:
        ConfigurationError: A number is out of range, the lens has distortion, or the image format is not supported.
    """
    fov = sensor.number("camera/horizontal_fov", 1.047)
    width, height = (sensor.number(f"camera/image/{name}", usual) for name, usual in _SIZE.items())
    if not 0.0 < fov < math.pi:
        raise sensor.error(f"<horizontal_fov> is {fov:g} rad; it must be above 0 and below pi.")
    if not (1.0 <= width <= _MOST_PIXELS and 1.0 <= height <= _MOST_PIXELS):
        raise sensor.error(
            f"the image size is {width:g} x {height:g} pixels; width and height must be from 1 to {_MOST_PIXELS}."
        )
    for name in ("k1", "k2", "k3", "p1", "p2"):
        if sensor.number(f"camera/distortion/{name}", 0.0):
            raise sensor.error(f"lens distortion is not supported; set <{name}> to 0.")
    given = sensor.text("camera/image/format", "R8G8B8")
    if given not in ENCODINGS:
        raise sensor.error(f"the image format {given} is not supported; choose one of {', '.join(ENCODINGS)}.")
    noise = sensor.number("camera/noise/mean", 0.0), sensor.number("camera/noise/stddev", 0.0)
    if not noise[1] >= 0.0:
        raise sensor.error(f"the standard deviation of the noise is {noise[1]:g}; it must be at least 0.")
    return CameraOptics(
        round(width), round(height), fov, sensor.number("camera/clip/far", 100.0), ENCODINGS[given], noise
    )


def camera_name(model: Model, sensor: SensorElement) -> str:
    """Return the name of a sensor's camera in the simulation."""
    return f"{model.key}/{sensor.link}/{sensor.name}"


def make_camera(model: Model, sensor: SensorElement) -> Camera:
    """Return a sensor's camera, which looks along the sensor's x axis with the z axis up.

    On a moving model, the camera is attached to a link. On a static model, the camera is fixed in the world.

    Raises:
        ConfigurationError: The ``<camera>`` element has invalid parameters.
    """
    if model.is_static:
        frame, place = None, sensor.place.after(model.link_place(sensor.link))
    else:
        frame, offset = f"{model.key}/{sensor.link}", model.description.offsets.get(sensor.link)
        place = sensor.place if offset is None else sensor.place.after(place_of(offset))
    pos, target, up = _looking(place)
    return Camera(pos=pos, target=target, up=up, fov_y=read_optics(sensor).fov_y, frame=frame)


def _looking(place: Place) -> tuple[tuple[float, float, float], ...]:
    ahead, up = quat_rotate(place.quat_wxyz, np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    return tuple((float(x), float(y), float(z)) for x, y, z in (place.pos, place.pos + ahead, up))

"""Cameras of scenes and robots."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, degrees


@dataclass(frozen=True, kw_only=True)
class Intrinsics:
    """Focal length and principal point of a camera, as a calibration with OpenCV or ROS returns them.

    The point (x, y, z), with x to the right, y down and z forward, is shown at the column fx · x / z + cx and the row
    fy · y / z + cy. The center of the upper left pixel is at (0, 0). Images of all sizes show the same section.

    Attributes:
        fx: Horizontal focal length [pixels].
        fy: Vertical focal length [pixels].
        cx: Column of the principal point [pixels].
        cy: Row of the principal point [pixels].
        width: Width of the image that these values refer to [pixels].
        height: Height of the image that these values refer to [pixels].
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Ratios of the left, right, lower and upper edge to the distance along the optical axis, y pointing up."""
        left, upper = (-0.5 - self.cx) / self.fx, (0.5 + self.cy) / self.fy
        return left, left + self.width / self.fx, upper - self.height / self.fy, upper


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A camera that is fixed in the world, to a robot's link or to a scene body.

    Attributes:
        pos: Position relative to ``frame`` [m], or in the world frame if ``frame`` is None.
        target: Point that the camera looks at, in the same frame [m].
        fov_y: Vertical field of view [deg]. If there are intrinsics, they define it.
        frame: ``"robot/link"`` or the name of a scene body, or None for the world. In the description of a robot, the
            name of a link.
        up: Direction that points up in the image, in the same frame. The up direction must not be parallel to the
            viewing direction. If None, the z axis is used, or the y axis for a camera that looks along z.
        intrinsics: Focal length and principal point. If None, pixels are square and the principal point is the center
            of the image.
    """

    pos: tuple[float, float, float]
    target: tuple[float, float, float]
    fov_y: float = 45.0
    frame: str | None = None
    up: tuple[float, float, float] | None = None
    intrinsics: Intrinsics | None = None

    def __post_init__(self) -> None:
        """Derive the field of view from the intrinsics."""
        if self.intrinsics is not None:
            _, _, lower, upper = self.intrinsics.extent
            object.__setattr__(self, "fov_y", degrees(atan(upper) - atan(lower)))

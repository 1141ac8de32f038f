from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from frobs_core.description import Lidar
from frobs_core.util.errors import ConfigurationError
from frobs_ros.robot.scans import rays_of

AROUND = Lidar(frame="base_link", rays=8, range_min=0.1, range_max=30.0)


def scan(beams: int, low: float, step: float) -> SimpleNamespace:
    angles = low + step * np.arange(beams)
    return SimpleNamespace(ranges=np.degrees(angles).tolist(), angle_min=low, angle_increment=step)


def test_each_ray_takes_its_nearest_beam() -> None:
    found = rays_of(scan(360, -math.pi, math.radians(1.0)), AROUND)
    assert found == pytest.approx(np.degrees(-math.pi + math.pi / 4 * np.arange(8)))


def test_a_scan_may_begin_elsewhere() -> None:
    found = rays_of(scan(360, 0.0, math.radians(1.0)), AROUND)
    assert found == pytest.approx([180.0, 225.0, 270.0, 315.0, 0.0, 45.0, 90.0, 135.0])


def test_a_scan_that_does_not_see_a_ray_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"requires a laser beam at -180°.*ranges from -90° to 90°"):
        rays_of(scan(181, -math.pi / 2, math.radians(1.0)), AROUND)

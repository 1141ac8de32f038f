from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frobs_core.description import Robot
from frobs_core.models import load_model
from frobs_core.util.errors import ConfigurationError
from frobs_devkit.robot_sheet import draw_robot_sheet
from frobs_devkit.robot_sheet.poses import choose_shots
from frobs_devkit.robot_sheet.sheet import _spread
from frobs_devkit.robot_sheet.stage import frame

ARM = """<robot name="arm">
<link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
<link name="upper"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
<visual><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.03" length="0.4"/></geometry></visual></link>
<link name="wheel"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
<visual><geometry><cylinder radius="0.1" length="0.02"/></geometry></visual></link>
<joint name="lift" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.05"/><limit lower="-0.5" upper="2.5" velocity="1" effort="10"/></joint>
<joint name="spin" type="continuous"><parent link="upper"/><child link="wheel"/><origin xyz="0 0 0.4"/>
<axis xyz="0 0 1"/></joint></robot>"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


def test_shots_are_home_the_limits_and_each_joint_at_its_own(arm: Path) -> None:
    shots = choose_shots(load_model(arm), {"lift": 0.2}, most=5)
    assert [shot.title for shot in shots.poses] == ["home", "all at lower limits", "all at upper limits"]
    assert [shot.joint_positions.tolist() for shot in shots.poses] == [[0.2, 0.0], [-0.5, 0.0], [2.5, 0.0]]
    [(low, high)] = shots.joints
    assert (low.title, low.caption, high.caption) == ("lift", "−29°", "143°")


def test_wheels_are_not_shown_one_by_one_as_nothing_would_be_seen(arm: Path) -> None:
    shots = choose_shots(load_model(arm), {}, most=5)
    assert [pair[0].title for pair in shots.joints] == ["lift"]
    assert shots.left_out == 1


@pytest.mark.parametrize("size", [(300, 200), (200, 500)])
def test_all_points_are_inside_of_the_picture_and_touch_an_edge(size: tuple[int, int]) -> None:
    points = np.random.default_rng(0).normal(size=(200, 3))
    pixels = frame(points, size, (0.9, 0.8)).project(points) / [size[1], size[0]] - 0.5  # of width and height
    assert np.all(np.abs(pixels) <= np.array([0.4, 0.45]) + 1e-9)
    assert np.abs(np.abs(pixels).max(axis=0) / [0.4, 0.45] - 1.0).min() < 1e-9


def test_labels_keep_apart_and_inside() -> None:
    rows = _spread([5.0, 6.0, 7.0, 290.0, 295.0], 300)
    assert rows == sorted(rows)
    assert min(np.diff(rows)) >= 26.0
    assert rows[0] >= 24.0
    assert rows[-1] <= 276.0


@pytest.mark.slow
@pytest.mark.needs("rendering")
def test_a_robot_sheet_shows_the_robot(arm: Path, tmp_path: Path) -> None:
    model = load_model(arm)
    path = draw_robot_sheet(Robot(model=str(arm)), model, tmp_path / "new" / "arm.png", "mujoco")
    from matplotlib.image import imread

    picture = imread(path)[..., :3]
    assert picture.shape[1] == 1600
    home = picture[126:786, 28:752]
    assert home.std() > 0.05  # not one colour
    assert np.abs(home - np.roll(home, 40, axis=1)).mean() > 0.01
    assert picture[-5:].min() == 1.0  # paper below


def test_only_png_is_written(arm: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"\.png"):
        draw_robot_sheet(Robot(model=str(arm)), load_model(arm), tmp_path / "arm.jpg")
    assert not (tmp_path / "arm.jpg").exists()

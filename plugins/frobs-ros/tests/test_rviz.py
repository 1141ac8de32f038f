"""A real RViz draws a robot that FRobs serves and moves: what is on its window is where it should be."""

from __future__ import annotations

import math
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from frobs_core.util.rotations import quat_rotate
from frobs_ros import rviz
from frobs_ros.policy_node.visualization import MARKERS, PATH

WIDTH, HEIGHT = 1200, 800  # of the window, in both configurations
FIELD_OF_VIEW = math.radians(45)  # of RViz's cameras, vertical
# x, y and lengths along x and y [m] of walls around the robot, and of a box
OBSTACLES = [
    (1, -1.6, 4.4, 0.1),
    (1, 2.2, 4.4, 0.1),
    (-1.2, 0.3, 0.1, 3.8),
    (3.2, 0.3, 0.1, 3.8),
    (1.6, -0.4, 0.5, 0.5),
]


class Screen:
    """An X server without a monitor, and RViz on all of it."""

    def __init__(self, config: Path, folder: Path, stack: ExitStack) -> None:
        from frobs_ros.ros.environment import child_variables

        self._frame, self._stack, self.log = folder / "Xvfb_screen0", stack, folder / "rviz.log"
        size = f"{WIDTH}x{HEIGHT}x24"
        words = ["Xvfb", "-displayfd", "1", "-screen", "0", size, "-fbdir", folder, "-nolisten", "tcp", "-nocursor"]
        server = self.start(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        assert server.stdout is not None
        display = server.stdout.readline().decode().strip()
        more = {"DISPLAY": f":{display}", "LIBGL_ALWAYS_SOFTWARE": "1", "QT_X11_NO_MITSHM": "1", "HOME": str(folder)}
        with self.log.open("wb") as log:
            words = ["rviz", "--fullscreen", "--display-config", config]
            self.start(words, env=child_variables() | more, stdout=log, stderr=subprocess.STDOUT)
        view = yaml.safe_load(config.read_text("utf-8"))["Visualization Manager"]["Views"]["Current"]
        self._focus = np.array([view["Focal Point"][axis] for axis in "XYZ"], float)
        yaw, pitch = view["Yaw"], view["Pitch"]
        self._back = np.array([math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch)])
        self.right = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        self.up = np.cross(self._back, self.right)
        self._eye = self._focus + view["Distance"] * self._back

    def start(self, words: list[Any], **options: Any) -> subprocess.Popen[bytes]:
        process = self._stack.enter_context(subprocess.Popen(words, **options))
        self._stack.callback(process.kill)
        return process

    def picture(self) -> np.ndarray:
        """Return what is on the screen, (height, width, 3) uint8: Xvfb keeps it in a file of the format XWD."""
        raw = self._frame.read_bytes()
        header = struct.unpack(">25I", raw[:100])
        size, width, height, row, colors = (header[i] for i in (0, 4, 5, 12, 19))
        pixels = np.frombuffer(raw, np.uint8, row * height, size + 12 * colors).reshape(height, row // 4, 4)
        return pixels[:, :width, 2::-1]

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return columns and rows, (n, 2), of points (n, 3) [m] in RViz's fixed frame."""
        seen = points - self._eye
        depth = -seen @ self._back
        scale = HEIGHT / 2 / math.tan(FIELD_OF_VIEW / 2) / depth
        return np.stack([WIDTH / 2 + scale * (seen @ self.right), HEIGHT / 2 - scale * (seen @ self.up)], axis=1)


@pytest.fixture
def show(rosmaster: str, tmp_path: Path) -> Iterator[Callable[[Path], Screen]]:
    """Opens RViz with a configuration, and waits until it listens."""
    import rosgraph

    with ExitStack() as stack:

        def open_screen(config: Path) -> Screen:
            screen = Screen(config, tmp_path, stack)
            master = rosgraph.Master("/client")
            wanted = {f"/{PATH}", f"/{MARKERS}"}
            _until(
                lambda: wanted <= {topic for topic, by in master.getSystemState()[1] if any("rviz" in n for n in by)},
                lambda: screen.log.read_text(),
            )
            return screen

        yield open_screen


def _until(condition: Callable[[], Any], explain: Callable[[], str], timeout: float = 90.0) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, explain()
        time.sleep(0.2)


def _run(*words: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "frobs_cli", "ros", "run", "--timeout", "30", *words], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def _is_orange(colors: np.ndarray) -> np.ndarray:
    r, g, b = colors.astype(int).transpose(2, 0, 1)
    return (r > 90) & (r > 1.8 * g) & (g > 1.5 * b)


def _is_gray(colors: np.ndarray) -> np.ndarray:
    low, high = colors.min(axis=-1).astype(int), colors.max(axis=-1).astype(int)
    return (high < 175) & (high - low < 25)


def _is_green(colors: np.ndarray) -> np.ndarray:
    r, g, b = colors.astype(int).transpose(2, 0, 1)
    return (g > r + 20) & (g > b + 10)


def _is_blue(colors: np.ndarray) -> np.ndarray:
    r, g, b = colors.astype(int).transpose(2, 0, 1)
    return (b > r + 80) & (b > g + 40)


def _is_red(colors: np.ndarray) -> np.ndarray:
    r, g, b = colors.astype(int).transpose(2, 0, 1)
    return (r > g + 80) & (r > b + 80)


def _share(
    picture: np.ndarray, pixels: np.ndarray, radius: int, has: Callable[[np.ndarray], np.ndarray]
) -> list[float]:
    """Return for each pixel (n, 2) which share of the pixels around it has a color."""
    shares = []
    for column, row in np.round(pixels).astype(int):
        inside = radius <= column < WIDTH - radius and radius <= row < HEIGHT - radius
        patch = picture[row - radius : row + radius + 1, column - radius : column + radius + 1]
        shares.append(float(has(patch).mean()) if inside else 0.0)
    return shares


def _check(screen: Screen, folder: Path, checks: Callable[[np.ndarray], dict[str, bool]]) -> None:
    """Wait until all checks of a picture pass; otherwise store the picture."""
    last: dict[str, Any] = {}

    def passes() -> bool:
        last["picture"] = screen.picture().copy()
        last["checks"] = checks(last["picture"])
        return all(last["checks"].values())

    def explain() -> str:
        return f"{last['checks']}; RViz: {screen.log.read_text()}"

    try:
        _until(passes, explain, 60.0)
    finally:
        Image.fromarray(last["picture"]).save(folder / "rviz.png")


def _array(point: Any) -> list[float]:
    return [point.x, point.y, point.z]


class Shown:
    """The path and the markers that a policy publishes for RViz."""

    def __init__(self) -> None:
        import rospy
        from nav_msgs.msg import Path as PathMessage
        from visualization_msgs.msg import MarkerArray

        self.path: Any = None
        self.markers: Any = None
        self._topics = [
            rospy.Subscriber(f"/{PATH}", PathMessage, lambda message: setattr(self, "path", message)),
            rospy.Subscriber(f"/{MARKERS}", MarkerArray, lambda message: setattr(self, "markers", message)),
        ]

    def close(self) -> None:
        for topic in self._topics:
            topic.unregister()

    def check(self, screen: Screen, picture: np.ndarray) -> dict[str, bool]:
        """Return whether the path and the goal have their colors in a picture where the robot does not cover them."""
        poses = np.array([_array(pose.pose.position) for pose in self.path.poses])
        path = np.concatenate([poses[:-1] + part * np.diff(poses, axis=0) for part in np.linspace(0.0, 1.0, 10)])
        (goal,) = (marker for marker in self.markers.markers if marker.ns == "goal")
        turn = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)[:, None]
        around = 0.4 * goal.scale.x * (np.cos(turn) * screen.right + np.sin(turn) * screen.up)
        ring = screen.project(_array(goal.pose.position) + around)
        return {
            "path": sum(share > 0.2 for share in _share(picture, screen.project(path), 3, _is_blue)) >= 12,
            "goal": sum(share > 0.8 for share in _share(picture, ring, 2, _is_green)) >= 6,
        }


@pytest.fixture
def shown(rosmaster: str) -> Iterator[Shown]:
    found = Shown()
    yield found
    found.close()


@pytest.fixture
def lookup(rosmaster: str) -> Iterator[Callable[[str, str], Any]]:
    """Returns the transform from a frame to another, as soon as it is known."""
    import rospy
    import tf2_ros

    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)

    def find(target: str, source: str) -> Any:
        _until(lambda: buffer.can_transform(target, source, rospy.Time()), lambda: f"no frames {target}, {source}")
        return buffer.lookup_transform(target, source, rospy.Time()).transform

    yield find
    listener.unregister()


@pytest.mark.slow
@pytest.mark.ros_feature("RViz", "ros", "mujoco")
@pytest.mark.ros_feature("policies as nodes", "mujoco")
def test_rviz_draws_an_arm_its_path_and_its_goal(
    bridges: Callable[..., Any],
    show: Callable[[Path], Screen],
    shown: Shown,
    lookup: Callable[[str, str], Any],
    tmp_path: Path,
) -> None:
    bridges("--robot", "irb120")
    screen = show(rviz.ARM)
    words = ["--controller", "arm_controller", "--goal", "0.4", "-0.15", "0.25", "--seconds", "5"]
    _run("frobs/Irb120Reach-v0", "--pretrained", *words)
    links = ["link_1", "link_2", "link_3", "link_4"]

    def checks(picture: np.ndarray) -> dict[str, bool]:
        frames = np.array([_array(lookup("base_link", link).translation) for link in links])
        orange = _share(picture, screen.project((frames[1:] + frames[:-1]) / 2), 20, _is_orange)
        return {"robot": min(orange) > 0.2, **shown.check(screen, picture)}

    _check(screen, tmp_path, checks)


@pytest.mark.slow
@pytest.mark.ros_feature("RViz", "ros", "mujoco")
@pytest.mark.ros_feature("policies as nodes", "mujoco")
@pytest.mark.ros_feature("laser scans", "mujoco")
@pytest.mark.ros_feature("world files", "mujoco")
def test_rviz_draws_a_mobile_robot_its_scan_its_path_and_its_goal(
    bridges: Callable[..., Any],
    show: Callable[[Path], Screen],
    shown: Shown,
    lookup: Callable[[str, str], Any],
    tmp_path: Path,
) -> None:
    import rospy
    from sensor_msgs.msg import LaserScan

    boxes = "".join(
        f'<model name="box_{i}"><static>true</static><pose>{x} {y} 0.3 0 0 0</pose><link name="l"><collision name="c">'
        f"<geometry><box><size>{length} {width} 0.6</size></box></geometry></collision></link></model>"
        for i, (x, y, length, width) in enumerate(OBSTACLES)
    )
    world = tmp_path / "room.world"
    world.write_text(
        f'<sdf version="1.6"><world name="room"><include><uri>model://ground_plane</uri></include>{boxes}</world></sdf>'
    )
    bridges("--robot", "kobuki", "--world", str(world))
    screen = show(rviz.MOBILE)
    _run("frobs/KobukiDynamic-v0", "--pretrained", "--goal", "2.5", "0.7", "0", "--seconds", "4")

    def hits() -> np.ndarray:
        """Return the pixels of the scan's points that are in the picture."""
        scan, lidar = rospy.wait_for_message("/scan", LaserScan, 30.0), lookup("odom", "lidar_link")
        angles, ranges = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges)), np.array(scan.ranges)
        rays = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)[np.isfinite(ranges)]
        turn = lidar.rotation
        quat = np.tile([turn.w, turn.x, turn.y, turn.z], (len(rays), 1))
        turned = quat_rotate(quat, rays * ranges[np.isfinite(ranges), None])
        pixels = screen.project(turned + _array(lidar.translation))
        return pixels[((pixels > 9) & (pixels < (WIDTH - 9, HEIGHT - 9))).all(axis=1)]

    def checks(picture: np.ndarray) -> dict[str, bool]:
        points, base = hits(), _array(lookup("odom", "base_link").translation)
        gray = _share(picture, screen.project(np.array([base]) + np.array([0.0, 0.0, 0.05])), 12, _is_gray)
        red = [share > 0.2 for share in _share(picture, points, 4, _is_red)]
        return {
            "robot": gray[0] > 0.6,
            "scan": sum(red) >= 3 and sum(red) >= 0.6 * len(red),  # the goal may cover some
            **shown.check(screen, picture),
        }

    _check(screen, tmp_path, checks)

"""The page in headless Chromium, whose software OpenGL is slow: the tests wait for states, not for frames."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from view_clients import wait_until

from frobs_core import load_policy
from frobs_core.util.rotations import matrix_from_quat, quat_from_matrix
from frobs_view import BrowserViewer, Player, RobotPage, ViewServer

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is in requirements-dev.txt")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [pytest.mark.slow, pytest.mark.needs("browser")]

PICK = "frobs_core:frobs/PandaPickAndPlace-v0"
KOBUKI = "frobs_core:frobs/KobukiEmpty-v0"
FLAGS = (
    *("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"),
)
HEIGHT, WIDTH, FOV = 480, 640, 0.8
COLORS = ((255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 0, 255))


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with sync_api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


class Page:
    """A tab that shows a view, and everything that it asked of the network or complained about."""

    def __init__(self, chromium: Any, server: ViewServer) -> None:
        self.tab = chromium.new_page(viewport={"width": 900, "height": 600})
        self.outside: list[str] = []
        self.errors: list[str] = []
        self.tab.on("request", self._on_request)
        self.tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.goto(server.address)
        self.tab.wait_for_selector("canvas")
        self.wait(lambda: bool(server.clients()))
        self.client = next(iter(server.clients().values()))

    def _on_request(self, request: Any) -> None:
        if not request.url.startswith(("http://localhost:", "http://127.0.0.1:", "data:", "blob:")):
            self.outside.append(request.url)

    def wait(self, condition: Callable[[], bool], seconds: float = 60.0) -> None:
        """Let the page work until a condition holds."""
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end
            self.tab.wait_for_timeout(50)


def camera_pose(eye: Any, target: Any) -> tuple[Any, Any]:
    """Return the rotation (3, 3) and the orientation (4,) of a camera with x to the right, y down and z ahead."""
    ahead = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    return turn, quat_from_matrix(turn)


def projected(point: Any, turn: Any, eye: Any, height: float, width: float, fov: float) -> Any:
    """Return the column and the row of a point, (2,) [pixels]."""
    x, y, z = turn.T @ (np.asarray(point) - eye)
    focal = 0.5 * height / np.tan(0.5 * fov)
    return np.array([0.5 * width + focal * x / z, 0.5 * height + focal * y / z])


@pytest.mark.parametrize(
    ("id", "simulator"), [(PICK, "mujoco"), (PICK, "pybullet"), (KOBUKI, "mujoco")], ids=["arm", "pybullet", "driving"]
)
def test_links_are_drawn_within_two_pixels(chromium: Any, id: str, simulator: str) -> None:
    """Compare points at the origins of links in the picture of the page with the poses of the simulator."""
    env: Any = gym.make(id, simulator=simulator, render_mode="browser").unwrapped
    env.reset(seed=3)
    for _ in range(5):
        env.step(env.action_space.sample())
    page = Page(chromium, env.viewer.server)
    viewer, scene = env.viewer, env.viewer.server.scene
    viewer.refresh()
    for node in (*viewer.drawing._shapes, *viewer._markers._nodes, viewer._goal):
        if node is not None:
            node.visible = False
    center = env.robot.base_pose[0][0]
    eye = center + np.array([1.2, -1.1, 0.9])
    turn, quat = camera_pose(eye, center + np.array([0.2, 0.0, 0.3]))
    links = spread(env, turn, eye)
    for link, color in zip(links, COLORS, strict=False):
        i = viewer.drawing.names.index(f"robot/{link}")
        scene.add_point_cloud(f"/frame{i}/probe", np.zeros((1, 3), np.float32), colors=color, point_size=0.02)
    picture = render(page, HEIGHT, WIDTH, quat, eye)
    for link, color in zip(links, COLORS, strict=False):
        expected = projected(env.robot.frame_pose(link)[0][0], turn, eye, HEIGHT, WIDTH, FOV)
        close = np.abs(picture[..., :3].astype(int) - color).max(axis=-1) < 60
        assert close.sum() > 4, f"{link} is not visible"
        rows, columns = np.nonzero(close)
        seen = np.array([columns.mean() + 0.5, rows.mean() + 0.5])
        assert np.abs(seen - expected).max() <= 2.0, (link, seen, expected)
    assert (page.outside, page.errors) == ([], [])
    page.tab.close()
    env.close()


def spread(env: Any, turn: Any, eye: Any) -> list[str]:
    """Return up to four links whose origins are apart in the picture."""
    found: dict[str, Any] = {}
    for link in reversed(env.robot.model.links):
        place = projected(env.robot.frame_pose(link.name)[0][0], turn, eye, HEIGHT, WIDTH, FOV)
        if all(np.abs(place - other).max() > 30.0 for other in found.values()) and len(found) < len(COLORS):
            found[link.name] = place
    return list(found)


def render(page: Page, height: int, width: int, quat: Any, eye: Any) -> Any:
    """Return a picture that the page draws for another camera, while the page can work."""
    pictures: list[Any] = []
    arguments = {"height": height, "width": width, "wxyz": quat, "position": eye, "fov": FOV}
    thread = threading.Thread(target=lambda: pictures.append(page.client.get_render(**arguments)))
    thread.start()
    page.wait(lambda: not thread.is_alive(), 120.0)
    return pictures[0]


def test_dragging_the_goal_with_the_mouse_moves_it(chromium: Any) -> None:
    env: Any = gym.make(PICK, render_mode="browser").unwrapped
    env.reset(seed=0, options={"goal": [0.5, 0.0, 0.2]})
    page = Page(chromium, env.viewer.server)
    for node in env.viewer.drawing._shapes:
        node.visible = False
    env.viewer.refresh()
    page.client.camera.position, page.client.camera.look_at = (0.5, -1.5, 0.3), (0.5, 0.0, 0.2)
    page.tab.wait_for_timeout(4000)
    box = page.tab.locator("canvas").first.bounding_box()
    camera = page.client.camera
    turn, eye = matrix_from_quat(np.array(camera.wxyz)), np.array(camera.position)
    start, end = (
        projected((x, 0.0, 0.2), turn, eye, box["height"], box["width"], camera.fov) + np.array([box["x"], box["y"]])
        for x in (0.6, 0.75)
    )
    page.tab.mouse.move(*start)
    page.tab.wait_for_timeout(1500)
    page.tab.mouse.down()
    for part in np.linspace(0.0, 1.0, 8)[1:]:
        page.tab.mouse.move(*(start + part * (end - start)))
        page.tab.wait_for_timeout(400)
    page.tab.mouse.up()
    page.wait(lambda: not env.viewer._events.empty())
    page.tab.wait_for_timeout(1000)
    env.viewer.poll()
    goal = env.task.goal[0]
    assert goal[0] > 0.55
    np.testing.assert_allclose(goal[1:], (0.0, 0.2), atol=0.02)
    page.tab.close()
    env.close()


def test_the_panel_swaps_the_policy_pauses_and_steps(chromium: Any) -> None:
    env: Any = gym.make(PICK)
    with closing(ViewServer()) as server:
        viewer = BrowserViewer(server)
        viewer.bind(env.unwrapped)
        env.unwrapped.after_step.append(lambda result: viewer.update())
        makers = {name: (lambda name=name: load_policy(name, env)) for name in ("random", "expert")}
        player = Player(env, viewer, makers)
        page = Page(chromium, server)

        def play(condition: Callable[[], bool]) -> None:
            end = time.monotonic() + 60.0
            while not condition():
                assert time.monotonic() < end
                polls = iter(range(5))
                player.run(lambda: next(polls, None) is not None)  # noqa: B023
                page.tab.wait_for_timeout(10)

        play(lambda: player.steps >= 10)
        assert page.tab.get_by_text("single step").count() == 1
        assert page.tab.get_by_text("Share").count() == 0
        page.tab.locator("input:visible").first.click()  # the list of policies
        page.tab.get_by_role("option", name="expert").click()
        play(lambda: player.name == "expert")
        page.tab.locator("input[type=checkbox]:visible").first.click()
        play(lambda: not player._play.value)
        before = player.steps
        page.tab.get_by_text("single step").click()
        play(lambda: player.steps > before)
        assert player.steps == before + 1
        assert (page.outside, page.errors) == ([], [])
        page.tab.close()
        player.close()
    env.close()


def test_the_page_of_a_robot_moves_its_joints(chromium: Any) -> None:
    with closing(ViewServer()) as server:
        robot = RobotPage("ur5", server)
        page = Page(chromium, server)
        before = robot.joint_positions.copy()
        slider = page.tab.get_by_role("slider").first
        slider.focus()
        for _ in range(5):
            page.tab.keyboard.press("ArrowRight")
        page.wait(lambda: not robot._events.empty())
        wait_until(lambda: not robot._events.empty())
        robot.poll()
        assert robot.joint_positions[0] > before[0]
        assert (page.outside, page.errors) == ([], [])
        page.tab.close()


def test_the_faults_of_the_page_are_those_that_the_guide_lists(chromium: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="see requirements-dev.txt")
    with closing(ViewServer()) as server:
        RobotPage("so101", server)
        page = Page(chromium, server)
        found = axe.Axe().run(page.tab, options={"resultTypes": ["violations"]}).response["violations"]
        page.tab.close()
    serious = {each["id"] for each in found if each["impact"] in ("serious", "critical")}
    assert serious == {"aria-input-field-name", "button-name", "color-contrast", "label"}

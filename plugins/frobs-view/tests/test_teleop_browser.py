"""People who act in headless Chromium: the handle, the panel, keys and a gamepad."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, cast

import gymnasium as gym
import numpy as np
import pytest
import viser
from test_view_browser import Page, chromium, projected
from view_clients import encode, open_socket

from frobs_core import load_policy
from frobs_core.util.rotations import matrix_from_quat
from frobs_view import Teleop

frobs_data = pytest.importorskip("frobs_data")

__all__ = ["chromium"]  # the fixture

pytestmark = [pytest.mark.slow, pytest.mark.needs("browser")]

PICK, REACH, KOBUKI = (f"frobs/{name}-v0" for name in ("PandaPickAndPlace", "Irb120Reach", "KobukiEmpty"))
FORWARD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
GAMEPAD = """() => {
  window.pad = {axes: [0, 0, 0, 0], buttons: Array.from({length: 17}, () => ({pressed: false})), connected: true};
  navigator.getGamepads = () => [null, window.pad];
}"""


class Recording:
    """A recording that runs in a thread, while this thread is the person at the browser.

    Attributes:
        env: The environment, which the other thread steps.
        person: The policy through which the person acts.
        page: The page in Chromium.
        steps: Number of control steps.
    """

    def __init__(self, chromium: Any, monkeypatch: pytest.MonkeyPatch, id: str, out: Path, **options: Any) -> None:
        bound: list[tuple[Any, Any]] = []
        bind = Teleop.bind

        def spied(policy: Any, env: Any) -> None:
            bind(policy, env)
            bound.append((policy, env.unwrapped))

        monkeypatch.setattr(Teleop, "bind", spied)
        self.result: list[Any] = []
        self.thread = threading.Thread(
            target=lambda: self.result.append(frobs_data.record(id, out=out, **options)), daemon=True
        )
        self.thread.start()
        while not bound:
            assert self.thread.is_alive()
            self.thread.join(0.05)
        self.person, self.env = bound[0]
        self.steps = 0
        self.env.after_step.append(self._count)
        server = self.person._viewer.server
        self.page = Page(chromium, server)
        self.hand: Any = None  # a second page, which drags the handle

    def _count(self, result: Any) -> None:
        self.steps += 1

    def click(self, name: str) -> None:
        """Click a button of the panel when it is there."""
        self.page.tab.get_by_role("button", name=name, exact=True).click(timeout=60_000)

    def drag(self, place: Any) -> None:
        """Drag the handle to a place."""
        if self.hand is None:
            self.hand = open_socket(self.person._viewer.server)
        with suppress(TimeoutError):
            while True:
                self.hand.recv(timeout=0.0)
        message = viser._messages.TransformControlsUpdateMessage
        self.hand.send(
            encode(message(name="/teleop", wxyz=(1.0, 0.0, 0.0, 0.0), position=cast(Any, tuple(map(float, place)))))
        )

    def wait(self, condition: Callable[[], bool]) -> None:
        self.page.wait(condition)

    def finish(self) -> Any:
        """Return the data set."""
        self.wait(lambda: not self.thread.is_alive())
        if self.hand is not None:
            self.hand.close()
        self.page.tab.close()
        return self.result[0]


def reach(recording: Recording, place: Callable[[], Any], tolerance: float = 0.006) -> None:
    """Drag the tool to a place, as long as it is not there."""

    def is_there() -> bool:
        recording.drag(place())
        return float(np.abs(recording.env.task.tool.pos[0] - place()).max()) < tolerance

    recording.wait(is_there)


def test_a_person_picks_and_places_a_cube_and_the_episodes_are_counted(
    chromium: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    options = {"policy": "teleop", "episodes": 1, "success_only": True, "max_episode_steps": 3000, "seed": 3}
    made = Recording(chromium, monkeypatch, PICK, tmp_path / "set", **options)
    tab, task = made.page.tab, made.env.task
    tab.get_by_text("episode 1 of 1, kept 0").wait_for(timeout=60_000)
    made.click("start")
    made.click("discard")
    tab.get_by_text("the last episode was discarded").wait_for(timeout=60_000)
    tab.keyboard.press("Enter")
    tab.get_by_role("button", name="keep", exact=True).wait_for(timeout=60_000)
    reach(made, lambda: task.grip[0] + 0.1 * UP)
    reach(made, lambda: task.grip[0])
    tab.keyboard.press("g")
    made.wait(lambda: made.person._gripper.opening() == -1.0)
    tab.wait_for_timeout(500)
    begin = task.tool.pos[0].copy()
    reach(made, lambda: begin + 0.1 * UP)
    assert task.cube.pos[0, 2] > 0.08
    reach(made, lambda: task.goal[0] + 0.1 * UP, 0.01)

    def is_placed() -> bool:
        made.drag(made.env.task.tool.pos[0] + np.clip(task.goal[0] - task.cube.pos[0], -0.05, 0.05))
        return bool(task.is_success()[0])

    made.wait(is_placed)
    tab.keyboard.press("Enter")
    dataset = made.finish()
    columns = dataset.columns(["next.success", "intervention", "action"])
    assert len(dataset.episodes) == 1
    assert columns["next.success"][-1]
    assert columns["intervention"].all()
    assert set(np.unique(columns["action"][:, 3])) == {-1.0, 0.0}
    assert (made.page.outside, made.page.errors) == ([], [])


def test_the_mouse_drags_the_tool(chromium: Any) -> None:
    env: Any = gym.make(f"frobs_core:{PICK}", render_mode="browser")
    with closing(env):
        observation, _ = env.reset(seed=0)
        policy = cast(Any, load_policy("teleop", env))
        viewer = env.unwrapped.viewer
        page = Page(chromium, viewer.server)
        for node in (*viewer.drawing._shapes, viewer._goal):
            node.visible = False
        begin = policy._main.pose()[0]
        page.client.camera.position, page.client.camera.look_at = begin + np.array([0.0, -1.2, 0.1]), begin
        page.tab.wait_for_timeout(4000)
        box, camera = page.tab.locator("canvas").first.bounding_box(), page.client.camera
        turn, eye = matrix_from_quat(np.array(camera.wxyz)), np.array(camera.position)
        start, end = (
            projected(begin + x * FORWARD, turn, eye, box["height"], box["width"], camera.fov)
            + np.array([box["x"], box["y"]])
            for x in (0.1, 0.2)
        )
        page.tab.mouse.move(*start)
        page.tab.wait_for_timeout(1500)
        page.tab.mouse.down()
        for part in np.linspace(0.0, 1.0, 8)[1:]:
            page.tab.mouse.move(*(start + part * (end - start)))
            page.tab.wait_for_timeout(400)
        page.wait(lambda: policy._dragged is not None)
        assert policy.is_moving
        page.tab.mouse.up()
        page.wait(lambda: not policy._is_dragging)
        for _ in range(40):
            action = policy.act(observation[None], np.zeros(1, bool))[0]
            observation, *_ = env.step(action)
        moved = policy._main.pose()[0] - begin
        assert moved[0] > 0.05
        np.testing.assert_allclose(moved[1:], 0.0, atol=0.01)
        page.tab.close()


@pytest.fixture
def driven(chromium: Any) -> Iterator[tuple[Any, Any, Page]]:
    env: Any = gym.make(f"frobs_core:{KOBUKI}", render_mode="browser")
    with closing(env):
        observation, _ = env.reset(seed=0)
        people = {name: cast(Any, load_policy(name, env)) for name in ("teleop:keyboard", "teleop:gamepad")}
        page = Page(chromium, env.unwrapped.viewer.server)
        page.tab.wait_for_timeout(1200)  # until the page knows which keys are wanted
        yield people, lambda name: people[name].act(observation[None], np.zeros(1, bool))[0].tolist(), page
        page.tab.close()


def test_keys_drive_a_robot_until_they_are_released_or_the_focus_is_lost(driven: Any) -> None:
    _, act, page = driven
    tab, camera = page.tab, page.client.camera
    before = np.array(camera.position)
    for key, expected in (("w", [1.0, 0.0]), ("ArrowLeft", [0.0, 1.0])):
        tab.keyboard.down(key)
        page.wait(lambda: act("teleop:keyboard") == expected)  # noqa: B023
        tab.wait_for_timeout(1500)  # the page repeats the key
        assert act("teleop:keyboard") == expected
        tab.keyboard.up(key)
        page.wait(lambda: act("teleop:keyboard") == [0.0, 0.0])
    np.testing.assert_allclose(np.array(camera.position), before)  # the keys move the robot, not the camera
    tab.keyboard.down("w")
    page.wait(lambda: act("teleop:keyboard") == [1.0, 0.0])
    tab.evaluate("window.dispatchEvent(new Event('blur'))")
    page.wait(lambda: act("teleop:keyboard") == [0.0, 0.0])
    tab.keyboard.up("w")
    tab.keyboard.down("w")
    page.wait(lambda: act("teleop:keyboard") == [1.0, 0.0])
    tab.goto("about:blank")  # the connection is lost
    page.wait(lambda: act("teleop:keyboard") == [0.0, 0.0])


def test_a_gamepad_drives_a_robot(driven: Any) -> None:
    _, act, page = driven
    page.tab.evaluate(f"({GAMEPAD})()")
    page.tab.evaluate("window.pad.axes = [0.25, -0.5, 0, 0]")
    page.wait(lambda: np.allclose(act("teleop:gamepad"), [0.5, -0.25]))
    page.tab.evaluate("document.hasFocus = () => false")
    page.wait(lambda: act("teleop:gamepad") == [0.0, 0.0])


def test_a_person_takes_over_from_a_running_policy(
    chromium: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    options = {"policy": "random", "takeover": "teleop:keyboard", "episodes": 1, "max_episode_steps": 3000}
    made = Recording(chromium, monkeypatch, REACH, tmp_path / "set", **options)
    made.click("start")
    tab = made.page.tab
    made.wait(lambda: made.steps > 20)
    tab.keyboard.press("t")
    made.wait(lambda: float(np.abs(made.env.robot.joint_velocities).max()) < 0.01)
    tab.keyboard.down("w")
    begin = made.person._main.pose()[0][0]
    made.wait(lambda: made.person._main.pose()[0][0] > begin + 0.02)
    tab.keyboard.up("w")
    made.click("keep")
    columns = made.finish().columns(["intervention", "observation.state"])
    taken = columns["intervention"]
    first = int(np.flatnonzero(taken)[0])
    assert first > 10
    assert taken[first:].all()
    joints = columns["observation.state"][first : first + 10, :6]
    assert np.abs(joints - joints[0]).max() < 0.3  # the arm stops, and does not jump
    assert (made.page.outside, made.page.errors) == ([], [])

"""The viewer without a browser: what a page receives, what it may change, and what it costs."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import gymnasium as gym
import imageio.v3 as iio
import numpy as np
import pytest
import viser
from view_clients import encode, messages, moves, open_socket, receive, wait_until

from frobs_core import load_policy
from frobs_core.kernel.drawn import frame_names
from frobs_core.util.errors import FrobsError
from frobs_view import BrowserViewer, Player, ViewServer
from templates.my_paced_simulator import RECORD

REACH = "frobs_core:frobs/Irb120Reach-v0"
PICK = "frobs_core:frobs/PandaPickAndPlace-v0"
SEEING = "frobs_core:frobs/PandaPickAndPlaceVision-v0"
KOBUKI = "frobs_core:frobs/KobukiEmpty-v0"


@pytest.fixture
def env(request: pytest.FixtureRequest) -> Iterator[Any]:
    options = getattr(request, "param", {"id": PICK})
    made = gym.make(render_mode="browser", **options).unwrapped
    made.reset(seed=0)
    yield made
    made.close()


def test_a_paced_simulator_is_drawn_too() -> None:
    """In the world of the template, which runs in another process, poses can only be computed from joint positions."""
    env: Any = gym.make(REACH, simulator=RECORD, render_mode="browser").unwrapped
    env.reset(seed=0)
    for _ in range(5):
        env.step(env.action_space.high)
    env.viewer.refresh()
    tool = frame_names(env).index(f"robot/{env.robot.frame_name('tcp')}")
    drawn = np.array(env.viewer.drawing.nodes[tool].position)
    expected = env.robot.model.frame_pose(env.robot.frame_name("tcp"), env.robot.joint_positions)[0][0]
    home = env.robot.model.frame_pose(env.robot.frame_name("tcp"), env.robot.home)[0][0]
    np.testing.assert_allclose(drawn, expected, atol=0.02)  # the world moves between two readings
    assert np.abs(drawn - home).max() > 0.02
    env.close()


def test_the_address_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "frobs"):
        env: Any = gym.make(REACH, render_mode="browser").unwrapped
    assert f"Open {env.viewer.address} in a browser" in caplog.text
    env.close()


@pytest.mark.parametrize("env", [{"id": PICK}, {"id": PICK, "simulator": "pybullet"}, {"id": KOBUKI}], indirect=True)
def test_frames_are_drawn_where_the_simulator_has_them(env: Any) -> None:
    for _ in range(3):
        env.step(env.action_space.sample())
    env.viewer.refresh()
    names = frame_names(env)
    for link in env.robot.model.links:
        node = env.viewer.drawing.nodes[names.index(f"robot/{link.name}")]
        np.testing.assert_allclose(node.position, env.robot.frame_pose(link.name)[0][0], atol=2e-4)
    for name, body in env.simulation.bodies.items():
        np.testing.assert_allclose(env.viewer.drawing.nodes[names.index(name)].position, body.pose[0][0], atol=2e-6)


def test_only_frames_that_moved_are_sent(env: Any) -> None:
    with open_socket(env.viewer.server) as client:
        env.viewer.refresh()
        receive(client, 1.0)
        env.viewer.refresh()
        assert moves(receive(client, 0.5)) == 0
        body = next(iter(env.simulation.bodies.values()))
        body.write_pose(body.pose[0] + 0.01)
        env.viewer.refresh()
        assert moves(receive(client, 0.5)) == 1


def test_without_a_page_nothing_is_read(env: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(env.viewer, "refresh", lambda: pytest.fail("poses were read"))
    for _ in range(20):
        env.step(env.action_space.sample())
    assert env.viewer.updates == 0


def test_at_least_25_updates_a_second_arrive_and_at_most_30() -> None:
    env: Any = gym.make(REACH, render_mode="browser").unwrapped
    env.reset(seed=0)
    with open_socket(env.viewer.server) as client:
        client.recv(timeout=5)
        begin, before, windows = time.monotonic(), env.viewer.updates, 0
        while time.monotonic() < begin + 3.0:
            env.step(env.action_space.sample())
            time.sleep(0.005)
            try:
                while True:
                    windows += moves(messages(client.recv(timeout=0))) > 0
            except TimeoutError:
                pass
        rate = (env.viewer.updates - before) / (time.monotonic() - begin)
    env.close()
    assert rate <= 30.5  # tests/benchmarks/view.py measures that 25 arrive
    assert windows > 0


@pytest.mark.parametrize("env", [{"id": PICK}, {"id": PICK, "simulator": "pybullet"}], indirect=True)
def test_an_update_sends_only_what_has_moved(env: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[str] = []
    socket = env.viewer.server._viser._websock_server
    push = socket.queue_message

    def record(message: Any) -> None:
        sent.append(type(message).__name__)
        push(message)

    monkeypatch.setattr(socket, "queue_message", record)
    env.viewer.refresh()
    sent.clear()
    env.viewer.refresh()
    assert sent == []
    env.step(env.action_space.sample())
    env.viewer.refresh()
    assert 0 < len(sent) <= 2 * len(env.viewer.drawing.nodes) + 4  # a position and an orientation each


def test_dragging_the_goal_moves_it(env: Any) -> None:
    message = viser._messages.TransformControlsUpdateMessage(
        name="/goal", wxyz=(1.0, 0.0, 0.0, 0.0), position=(0.5, 0.1, 0.2)
    )
    with open_socket(env.viewer.server) as client:
        client.recv(timeout=5)
        client.send(encode(message))
        wait_until(lambda: not env.viewer._events.empty())
        env.viewer.update()
    np.testing.assert_allclose(env.task.goal[0], (0.5, 0.1, 0.2), atol=1e-6)


@pytest.mark.needs("rendering")
@pytest.mark.parametrize("env", [{"id": SEEING}], indirect=True)
def test_the_page_shows_what_the_chosen_camera_sees(env: Any) -> None:
    controls = env.viewer.server._viser.gui._gui_input_handle_from_uuid.values()
    [cameras] = [control for control in controls if control.label == "camera"]
    assert cameras.options == ("none", "whole", "overview", "wrist")
    with open_socket(env.viewer.server) as client:
        client.recv(timeout=5)
        cameras.value = "wrist"
        wait_until(lambda: not env.viewer._events.empty())
        env.viewer.update()
        sent = [one["updates"] for one in receive(client, 1.0) if one["type"] == "GuiUpdateMessage"]
    shown = iio.imread(sent[-1]["_data"], extension=".jpeg").astype(int)
    expected = env.simulation.render(None, "wrist", shown.shape[:2], "rgb", env.task.markers())[0]
    assert np.abs(shown - expected).mean() < 6.0  # it was compressed
    assert expected.std() > 20.0


@pytest.mark.parametrize("place", [(5.0, 0.0, 0.2), (np.nan, 0.0, 0.2), (0.5, 0.0, np.inf), (0.5, 0.0, -3.0)])
def test_a_goal_that_cannot_be_stays_where_it_was(env: Any, place: tuple[float, float, float]) -> None:
    before = env.task.goal.copy()
    env.viewer.call(lambda: env.viewer._move_goal(np.array(place)))
    env.viewer.update()
    np.testing.assert_array_equal(env.task.goal, before)


@pytest.mark.parametrize("env", [{"id": "frobs_core:frobs/PandaStack-v0"}], indirect=True)
def test_a_goal_that_follows_an_object_has_no_handle(env: Any) -> None:
    assert env.viewer._goal is None


def test_toggles_show_and_hide(env: Any) -> None:
    viewer = env.viewer
    for switch in (viewer.drawing.show_collisions, viewer.drawing.show_frames):
        for on in (True, False):
            switch(on)
    assert all(node.visible for node in viewer.drawing._shapes)
    assert not any(node.visible for node in viewer.drawing._collisions)
    viewer._trail_box.value = True
    for _ in range(5):
        env.step(env.action_space.sample())
        viewer.refresh()
    assert len(viewer._trail._node.points) == 4
    env.reset()
    assert viewer._trail._node is None


@pytest.mark.parametrize("env", [{"id": KOBUKI}], indirect=True)
def test_closed_contacts_are_points_and_their_forces_arrows(env: Any) -> None:
    state, viewer, contacts = env.simulation.contacts, env.viewer, env.viewer._contacts
    viewer._contacts_box.value = True
    viewer.refresh()
    assert contacts._nodes == {}
    state.closed[0, 0], state.resultant[0, 0] = True, (0.0, 20.0, 0.0)
    viewer.refresh()
    assert list(contacts._nodes) == ["points"]  # a bumper measures no force
    contacts._has_force[0] = True
    viewer.refresh()
    [arrow] = contacts._nodes["forces"].points
    np.testing.assert_allclose(arrow[1] - arrow[0], (0.0, 0.1, 0.0), atol=1e-6)
    state.resultant[0, 0] = (0.0, 0.0, 1e6)
    viewer.refresh()
    [arrow] = contacts._nodes["forces"].points
    np.testing.assert_allclose(arrow[1] - arrow[0], (0.0, 0.0, 0.4), atol=1e-6)
    state.clear()
    viewer.refresh()
    assert contacts._nodes == {}


def test_a_vector_environment_shows_one_row_at_a_time() -> None:
    env: Any = gym.make_vec(REACH, num_envs=3, render_mode="browser").unwrapped
    env.reset(seed=0)
    env.viewer.show(2)
    tool = frame_names(env).index(f"robot/{env.robot.frame_name('tcp')}")
    np.testing.assert_allclose(env.viewer.drawing.nodes[tool].position, env.robot.frame_pose("tcp")[0][2], atol=1e-6)
    env.viewer.show(99)
    assert env.viewer.row == 2
    env.close()


def test_policies_are_swapped_while_they_run() -> None:
    server = ViewServer()
    env: Any = gym.make(PICK)
    viewer = BrowserViewer(server)
    viewer.bind(env.unwrapped)
    made: list[str] = []

    def maker(name: str) -> Any:
        def make() -> Any:
            made.append(name)
            return load_policy(name, env)

        return make

    def broken() -> Any:
        raise FrobsError("this policy is broken.")

    player = Player(env, viewer, {"random": maker("random"), "expert": maker("expert"), "broken": broken})
    player.reset(0)
    for name in ("random", "expert", "random"):
        viewer.call(lambda name=name: player._try(name))  # type: ignore[misc]
        viewer.poll()
        player.step()
    assert (made, player.name) == (["random", "expert"], "random")
    viewer.call(lambda: player._try("broken"))
    viewer.poll()
    assert (player.name, player._chooser.value) == ("random", "random")
    player._play.value = False
    viewer.call(player._step_once)
    steps, polls = player.steps, iter(range(5))
    player.run(lambda: next(polls, None) is not None)
    assert player.steps == steps + 1
    player.close()
    env.close()
    server.close()


def test_nothing_is_played_while_no_page_is_open() -> None:
    env: Any = gym.make(REACH)
    with closing(ViewServer()) as server:
        viewer = BrowserViewer(server)
        viewer.bind(env.unwrapped)
        player = Player(env, viewer, {"random": lambda: load_policy("random", env)}, seed=2**32 - 1)
        polls = iter(range(10))
        player.run(lambda: next(polls, None) is not None)
        assert player.steps == 0
        with open_socket(server) as client:
            client.recv(timeout=5)
            polls = iter(range(10))
            player.run(lambda: next(polls, None) is not None)
        assert player.steps == 10
        player.close()
    env.close()


def test_an_episode_with_the_expert_succeeds_in_the_view() -> None:
    server = ViewServer()
    env: Any = gym.make_vec(PICK, num_envs=2)
    viewer = BrowserViewer(server)
    viewer.bind(env.unwrapped)
    successes: list[float] = []
    env.unwrapped.after_step.append(lambda result: successes.append(float(result[4]["is_success"].max())))
    player = Player(env, viewer, {"expert": lambda: load_policy("expert", env)})
    player.reset(0)
    for _ in range(150):
        player.step()
    assert max(successes) == 1.0
    player.close()
    env.close()
    server.close()

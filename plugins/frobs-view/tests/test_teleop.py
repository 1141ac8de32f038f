"""People who act on the page: handle, keys and gamepads, as the page sends them, without a browser."""

from __future__ import annotations

import json
import urllib.parse
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any, cast

import gymnasium as gym
import numpy as np
import pytest
import viser
from view_clients import encode, open_socket, port_of, receive_until_silent, wait_until
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from frobs_core import load_policy
from frobs_core.util.errors import FrobsError, RunError
from frobs_view import BrowserViewer, Devices, Player, Teleop, ViewServer
from frobs_view.devices import TIMEOUT
from frobs_view.gate import MAX_CLIENTS

PICK, REACH, KOBUKI = (f"frobs_core:frobs/{name}-v0" for name in ("PandaPickAndPlace", "Irb120Reach", "KobukiEmpty"))

OFFSET = np.array([0.08, 0.06, -0.05])


def state(*keys: str, axes: Any = (), buttons: Any = ()) -> str:
    return json.dumps({"keys": keys, "axes": list(axes), "buttons": list(buttons)})


def open_input(server: ViewServer, *, origin: str | None = "", path: str = "/input") -> Any:
    """Connect as the script of the page does, or with another origin or path."""
    host = f"localhost:{port_of(server)}"
    chosen: Any = f"http://{host}" if origin == "" else origin
    return connect(f"ws://{host}{path}", origin=chosen, proxy=None)


class Session:
    """A person in an environment, whose page is a pair of connections."""

    def __init__(self, id: str, policy: str, **keywords: Any) -> None:
        self.env: Any = gym.make_vec(id, num_envs=1, **keywords)
        self.policy = cast(Any, load_policy(policy, self.env))
        self.server: ViewServer = self.policy._viewer.server
        self.page, self.input = open_socket(self.server), open_input(self.server)
        self.page.recv(timeout=5)
        wait_until(lambda: self.server.has_clients)
        self.observation, _ = self.env.reset(seed=0)
        self.step(start=True)

    def step(self, count: int = 1, start: bool = False) -> Any:
        """Let the person act for some steps, and return the last action."""
        for _ in range(count):
            action = self.policy.act(self.observation, np.array([start]))
            assert action in self.env.action_space
            self.observation, *_ = self.env.step(action)
        return action[0]

    def send(self, *keys: str, **devices: Any) -> None:
        """Send the state of keys and the gamepad, and wait until it has arrived."""
        before = self.server.devices._states
        arrived = {id(each) for each in before.values()}
        self.input.send(state(*keys, **devices))
        wait_until(lambda: any(id(each) not in arrived for each in before.values()))

    def drag(self, pos: Any, wxyz: Any = (1.0, 0.0, 0.0, 0.0)) -> None:
        """Drag the handle, as the page does it, and leave it there."""
        kind = viser._messages
        place: Any = tuple(float(each) for each in pos)
        self.page.send(encode(kind.TransformControlsDragStartMessage(name="/teleop")))
        self.page.send(encode(kind.TransformControlsUpdateMessage(name="/teleop", wxyz=wxyz, position=place)))
        wait_until(lambda: self.policy._dragged is not None and np.allclose(self.policy._dragged[0], place))
        wait_until(lambda: np.allclose(self.policy._dragged[1], wxyz))

    def release(self) -> None:
        self.page.send(encode(viser._messages.TransformControlsDragEndMessage(name="/teleop")))
        wait_until(lambda: not self.policy._is_dragging)

    @property
    def place(self) -> Any:
        return self.policy._main.pose()[0]

    @property
    def opening(self) -> float:
        return float(self.policy._gripper.opening())


@contextmanager
def session(id: str, policy: str = "teleop", **keywords: Any) -> Iterator[Session]:
    made = Session(id, policy, **keywords)
    with closing(made.env), closing(made.policy), made.page, made.input:
        yield made


@pytest.mark.parametrize("controller", ["joint_delta_position", "joint_position", "joint_velocity", "tcp_delta_pose"])
def test_the_tool_follows_the_handle_with_every_controller_of_an_arm(controller: str) -> None:
    with session(REACH, controller=controller) as person:
        begin = person.place
        held = person.place.copy()
        person.step(3)
        np.testing.assert_allclose(person.place, held, atol=2e-3)  # nothing jumps
        person.drag(begin + OFFSET, (np.cos(0.15), 0.0, 0.0, np.sin(0.15)))
        person.step(42)
        np.testing.assert_allclose(person.place, begin + OFFSET, atol=5e-3)
        turned = person.policy._main.pose()[1]
        expected = person.policy._wish().target[1]
        assert abs(float(turned @ expected)) > np.cos(0.02)


def test_the_handle_opens_and_closes_the_gripper_with_a_command() -> None:
    with session(PICK) as person:
        before = person.opening
        assert person.step()[3] == 0.0
        person.policy._choose(("gripper",))
        person.step(10)
        assert person.opening == pytest.approx(-np.sign(before))
        person.policy._choose(("gripper",))
        person.step(10)
        assert person.opening == pytest.approx(np.sign(before))


def test_a_wheeled_robot_drives_to_the_handle() -> None:
    with session(KOBUKI) as person:
        goal = person.place + np.array([0.8, 0.8, 0.0])
        person.drag(goal)
        person.step(60)
        assert np.linalg.norm(person.place[:2] - goal[:2]) < 0.06
        np.testing.assert_array_equal(person.step(), [0.0, 0.0])


def test_keys_move_an_arm_a_gripper_single_joints_and_a_wheeled_robot() -> None:
    with session(PICK, "teleop:keyboard") as person:
        begin, opening = person.place, person.opening
        person.send("KeyW", "KeyR")
        np.testing.assert_array_equal(person.step(), [1.0, 0.0, 1.0, 0.0])
        person.send("KeyD")
        np.testing.assert_array_equal(person.step(), [0.0, -1.0, 0.0, 0.0])
        person.send("KeyG")
        assert person.step()[3] == -np.sign(opening)
        assert (person.place - begin)[0] > 0.005
    with session(REACH, "teleop:keyboard") as person:
        joints = person.env.unwrapped.robot.joint_positions[0].copy()
        person.send("Digit2", "ShiftLeft")
        person.step(5)
        moved = person.env.unwrapped.robot.joint_positions[0] - joints
        assert np.flatnonzero(np.abs(moved) > 0.03).tolist() == [1]
        assert moved[1] < 0.0
    with session(KOBUKI, "teleop:keyboard") as person:
        person.send("ArrowUp", "ArrowLeft")
        np.testing.assert_array_equal(person.step(), [1.0, 1.0])


def test_a_gamepad_moves_an_arm_a_gripper_and_a_wheeled_robot() -> None:
    with session(PICK, "teleop:gamepad") as person:
        opening = person.opening
        person.send(axes=[-0.5, -1.0, 0.0, 0.05])  # the last is in the dead zone
        np.testing.assert_allclose(person.step(), [1.0, 0.5, 0.0, 0.0])
        person.send(axes=[0.0, 0.0, 0.0, -1.0], buttons=[0])
        np.testing.assert_allclose(person.step(), [0.0, 0.0, 1.0, -np.sign(opening)])
    with session(KOBUKI, "teleop:gamepad") as person:
        person.send(axes=[0.25, 0.5])
        np.testing.assert_allclose(person.step(), [-0.5, -0.25])


def test_the_motion_stops_when_the_connection_is_lost() -> None:
    with session(PICK, "teleop:keyboard") as person:
        person.send("KeyW")
        assert person.policy.is_moving
        person.input.close()
        wait_until(lambda: not person.server.devices.keys())
        np.testing.assert_array_equal(person.step()[:3], 0.0)
    with session(PICK) as person:
        person.drag(person.place + np.array([0.2, 0.0, 0.0]))
        person.step(3)
        assert person.policy.is_moving
        person.page.close()
        wait_until(lambda: not person.server.has_clients)
        np.testing.assert_allclose(person.step()[:3], 0.0, atol=0.2)
        assert not person.policy.is_moving


def test_keys_are_released_when_their_page_falls_silent_and_while_it_lives_they_are_not() -> None:
    now = [0.0]
    devices = Devices(lambda: now[0])
    devices.wanted = frozenset({"KeyW", "button0"})
    assert devices.receive("page", state("KeyW", "KeyQ", axes=[0.5, -3.0], buttons=[0]))
    assert devices.keys() == {"KeyW"} | {"button0"}
    np.testing.assert_array_equal(devices.axes(), [0.5, -1.0, 0.0, 0.0])
    assert devices.presses() == ["KeyW", "button0"]
    now[0] = TIMEOUT
    assert devices.receive("other", state("KeyW"))
    assert devices.keys()
    now[0] = TIMEOUT + 0.01
    assert devices.keys() == {"KeyW"}
    assert not devices.axes().any()
    devices.release("other")
    assert not devices.keys()


@pytest.mark.parametrize(
    "message",
    ["", "{}", "[]", "nan", b"{}", state() + " " * 3000, '{"keys": 1, "axes": [], "buttons": []}', "[" * 1900]
    + [state(axes=[value]) for value in ("x", None, float("nan"))]
    + ['{"keys": [], "axes": {}, "buttons": []}', '{"keys": [], "axes": [], "buttons": ["x"]}'],
)
def test_malformed_states_close_the_connection(message: Any) -> None:
    assert not Devices().receive("page", message)
    with closing(ViewServer(port=0)) as server, open_input(server) as page:
        page.send(message)
        with pytest.raises(ConnectionClosed) as caught:
            page.recv(timeout=5)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1008
        assert not server.devices._states


def test_the_input_checks_origin_token_and_number_of_clients() -> None:
    with closing(ViewServer(port=0)) as server:
        with pytest.raises(InvalidStatus) as caught:
            open_input(server, origin="http://evil.example")
        assert caught.value.response.status_code == 403
        pages = [open_input(server) for _ in range(MAX_CLIENTS)]
        wait_until(lambda: len(server._gate._inputs) == MAX_CLIENTS)
        with pytest.raises(InvalidStatus) as caught:
            open_input(server)
        assert caught.value.response.status_code == 503
        assert not server.has_clients
        with open_socket(server) as client:  # pages have places of their own
            assert client.recv(timeout=5)
        for page in pages:
            page.close()
    with closing(ViewServer(host="127.0.0.1", port=0)) as server:
        parts = urllib.parse.urlsplit(server.address)
        origin: Any = f"http://{parts.netloc}"
        with pytest.raises(InvalidStatus) as caught:
            connect(f"ws://{parts.netloc}/input", origin=origin, proxy=None)
        assert caught.value.response.status_code == 403
        connect(f"ws://{parts.netloc}{parts.path}input", origin=origin, proxy=None).close()


def test_no_key_is_reported_until_a_person_acts() -> None:
    with closing(ViewServer(port=0)) as server, open_input(server) as page:
        page.send(state("KeyW"))
        with pytest.raises(TimeoutError):
            page.recv(timeout=0.5)
        assert not server.devices.keys()
        server.devices.wanted = frozenset({"KeyW"})
        page.send(state("KeyW"))
        assert json.loads(page.recv(timeout=5)) == ["KeyW"]
        assert server.devices.keys() == {"KeyW"}


def test_commands_come_from_keys_and_buttons_and_only_if_they_are_offered() -> None:
    with session(PICK, "teleop:keyboard") as person:
        person.policy.offer(("start",))
        for keys, expected in ((("Backspace",), ""), (("Enter",), "start"), (("Enter", "KeyT"), "")):
            person.send(*keys)
            assert person.policy.command() == expected
        person.policy.offer(("keep", "discard", "take over"))
        person.send()
        person.send(buttons=[8])
        person.send("KeyT")
        person.send("Enter")
        assert [person.policy.command() for _ in range(4)] == ["discard", "take over", "keep", ""]
        person.policy.show("episode 1 of 2")
        assert person.policy._status.content == "episode 1 of 2"


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        (
            {"controller": "joint_effort"},
            "the controller JointEffort of robot/all cannot be teleoperated; choose one of",
        ),
        ({"controller": "discrete"}, "the controller Discrete of robot/all cannot be teleoperated"),
        ({"controller_kwargs": {"full_range": True}}, "full_range"),
        ({"num_envs": 2}, "a person can act in 1 environment, not in 2"),
    ],
)
def test_an_environment_that_cannot_be_teleoperated_is_one_error(keywords: Any, message: str) -> None:
    env = gym.make_vec(REACH, **{"num_envs": 1, **keywords})
    with closing(env), pytest.raises(RunError, match=message):
        load_policy("teleop", env)


def test_other_environments_cannot_be_teleoperated() -> None:
    env = gym.make("CartPole-v1")
    with closing(env), pytest.raises(FrobsError, match="only environments of FRobs"):
        load_policy("teleop:gamepad", env)


def test_a_viewer_that_is_there_is_used() -> None:
    env: Any = gym.make(REACH, render_mode="browser")
    with closing(env):
        policy = load_policy("teleop", env)
        assert isinstance(policy, Teleop)
        assert isinstance(env.unwrapped.viewer, BrowserViewer)
        assert policy._viewer is env.unwrapped.viewer
        policy.close()
        with open_socket(env.unwrapped.viewer.server) as client:
            receive_until_silent(client)


def test_the_panel_and_the_keys_of_a_person_who_no_longer_acts_disappear() -> None:
    env: Any = gym.make(PICK, render_mode="browser")
    with closing(env):
        viewer = env.unwrapped.viewer
        names = ("teleop", "teleop:keyboard", "random")
        makers = {name: lambda name=name: load_policy(name, env) for name in names}
        player = Player(env, viewer, makers)
        before = set(viewer.server.gui._container_handle_from_uuid)
        for name in ("teleop:keyboard", "teleop", "random", "teleop"):
            player._try(name)
            player.reset(0)
            player.step()
            is_person = name != "random"
            added = set(viewer.server.gui._container_handle_from_uuid) - before
            assert len(added) <= 1
            assert bool(viewer.server.devices.wanted) == is_person
            assert ("KeyW" in viewer.server.devices.wanted) == (name == "teleop:keyboard")
            assert ("/teleop" in viewer.server.scene._handle_from_node_name) == (name == "teleop")
        player.close()
        player.close()
        assert not viewer.server.devices.wanted

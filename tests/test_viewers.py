"""Viewers as render modes, what is drawn of an environment, and goals that move during an episode."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import pytest

from frobs_core import plugins
from frobs_core.contracts import Viewer
from frobs_core.kernel.config import EnvConfig
from frobs_core.kernel.drawn import drawn_parts, frame_names, frame_poses
from frobs_core.kernel.viewers import render_modes
from frobs_core.plugins import Plugins
from frobs_core.plugins.records import RECORDS_OF_CORE, ViewerRecord
from frobs_core.util.errors import ConfigurationError, ParameterValueError
from frobs_core.util.rotations import matrix_from_quat

REACH = "frobs_core:frobs/Irb120Reach-v0"
PICK = "frobs_core:frobs/PandaPickAndPlace-v0"
SIMULATORS = ["mujoco", "pybullet"]


class Counting(Viewer):
    """Counts its calls and what it sees."""

    made: ClassVar[list[Counting]] = []

    def bind(self, env: Any) -> None:
        self.env, self.times, self.closed = env, [], 0
        self.made.append(self)

    def update(self) -> None:
        self.times.append(round(float(self.env.simulation.time[0]), 3))

    def close(self) -> None:
        self.closed += 1


class Refusing(Counting):
    """Cannot show anything."""

    def bind(self, env: Any) -> None:
        super().bind(env)
        raise ConfigurationError("nothing can be shown.")


@pytest.fixture
def counting(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Counting]]:
    """Two further viewers, as a plugin would provide them."""
    records = [
        ViewerRecord(name=name, summary="counts", entry_point=f"{__name__}:{name.title()}")
        for name in ("counting", "refusing")
    ]
    monkeypatch.setitem(RECORDS_OF_CORE, "viewer", (*RECORDS_OF_CORE["viewer"], *records))  # type: ignore[misc]
    monkeypatch.setattr(Counting, "made", [])
    with plugins.isolated(Plugins()):
        yield Counting.made


@pytest.fixture
def env(request: pytest.FixtureRequest) -> Iterator[Any]:
    made = gym.make(**request.param).unwrapped
    made.reset(seed=0)
    yield made
    made.close()


def test_a_viewer_is_called_after_each_reset_and_step(counting: list[Counting]) -> None:
    env = gym.make(REACH, render_mode="counting")  # a warning of Gymnasium about the mode would be an error
    env.reset(seed=0)
    for _ in range(2):
        env.step(env.action_space.sample())
    assert env.render() is None
    env.close()
    assert [(viewer.times, viewer.closed) for viewer in counting] == [([0.0, 0.04, 0.08], 1)]
    assert "counting" in env.metadata["render_modes"]


def test_a_vector_environment_has_the_viewer_too(counting: list[Counting]) -> None:
    env = gym.make_vec(REACH, num_envs=2, render_mode="counting")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.close()
    assert [(viewer.times, viewer.closed) for viewer in counting] == [([0.0, 0.04], 1)]


def test_without_a_viewer_nothing_is_called() -> None:
    env = gym.make(REACH).unwrapped
    assert env.viewer is None
    assert env.after_step == []
    env.close()


def test_a_viewer_that_refuses_leaves_no_simulation_open(counting: list[Counting]) -> None:
    with pytest.raises(ConfigurationError, match="nothing can be shown"):
        gym.make(REACH, render_mode="refusing")
    assert counting[0].env.simulation._closed


def test_an_unknown_render_mode_lists_the_viewers() -> None:
    with pytest.raises(ParameterValueError, match=r"'rgb_array', 'human'.*did you mean 'human'"):
        EnvConfig(task="reach", render_mode="humann")


def test_a_viewer_that_is_not_installed_says_how_to_install_it() -> None:
    with (
        plugins.isolated(Plugins([])),
        pytest.raises(ParameterValueError, match=r"one of 'rgb_array', 'human'; to install 'browser': pip install"),
    ):
        EnvConfig(task="reach", render_mode="browser")


def test_the_engines_window_is_the_first_viewer(monkeypatch: pytest.MonkeyPatch) -> None:
    assert render_modes()[:2] == ["rgb_array", "human"]
    env = gym.make(REACH, render_mode="human").unwrapped
    opened: list[float] = []
    monkeypatch.setattr(env.simulation, "open_viewer", lambda: opened.append(float(env.simulation.time[0])))
    for _ in range(2):
        env.reset(seed=0)
        env.step(env.action_space.sample())
    env.close()
    assert opened == [0.0, 0.0]


@pytest.mark.parametrize("env", [{"id": PICK, "simulator": name} for name in SIMULATORS], indirect=True, ids=SIMULATORS)
def test_link_poses_are_the_frame_poses_of_all_links(env: Any) -> None:
    for _ in range(5):
        env.step(env.action_space.sample())
    pos, quat = env.robot.link_poses()
    assert pos.shape == (1, len(env.robot.model.links), 3)
    for i, link in enumerate(env.robot.model.links):
        expected, turn = env.robot.frame_pose(link.name)
        np.testing.assert_allclose(pos[:, i], expected, atol=2e-4)  # PyBullet couples the fingers by constraints
        np.testing.assert_allclose(matrix_from_quat(quat[:, i]), matrix_from_quat(turn), atol=2e-3)


@pytest.mark.parametrize("id", [REACH, PICK, "frobs_core:frobs/KobukiEmpty-v0"])
def test_what_is_drawn_lies_in_the_frames_of_the_environment(id: str) -> None:
    env = gym.make_vec(id, num_envs=2)
    env.reset(seed=0)
    inner: Any = env.unwrapped
    parts, names = drawn_parts(inner), frame_names(inner)
    assert len({part.name for part in parts}) == len(parts)
    assert {part.frame for part in parts} <= set(names)
    assert sum(not part.only_collides for part in parts) > 3
    for row in range(2):
        pos, quat = frame_poses(inner, row)
        assert pos.shape == (len(names), 3)
        assert quat.shape == (len(names), 4)
        for name, body in inner.simulation.bodies.items():
            np.testing.assert_array_equal(pos[names.index(name)], body.pose[0][row])
        tool = names.index(f"robot/{inner.robot.frame_name('tcp')}")
        np.testing.assert_allclose(pos[tool], inner.robot.frame_pose("tcp")[0][row], atol=1e-9)
    env.close()


@pytest.mark.parametrize(
    ("id", "goal"),
    [(REACH, (0.4, 0.1, 0.4)), (PICK, (0.5, 0.05, 0.2)), ("frobs_core:frobs/KobukiEmpty-v0", (2.0, 1.0, 0.0))],
)
def test_a_goal_can_be_moved_during_an_episode(id: str, goal: tuple[float, float, float]) -> None:
    env = gym.make_vec(id, num_envs=2)
    env.reset(seed=0)
    task = env.unwrapped.task  # type: ignore[attr-defined]

    def goals() -> Any:
        return next(marker.pos for marker in task.markers() if marker.name == "goal")

    before = goals().copy()
    task.set_goal(np.array([goal]), np.array([False, True]))
    env.step(np.zeros(env.action_space.shape))
    np.testing.assert_allclose(goals()[1], goal)
    np.testing.assert_allclose(goals()[0], before[0])
    env.close()


@pytest.mark.parametrize(
    ("id", "goal", "text"),
    [
        (REACH, (5.0, 0.0, 0.0), "out of reach"),
        (PICK, (0.5, 0.0, -1.0), "height"),
        ("frobs_core:frobs/Irb120ReachDynamic-v0", (0.4, 0.0, 0.4), "moves by itself"),
        ("frobs_core:frobs/PandaStack-v0", (0.4, 0.0, 0.4), "has no goal that can be moved"),
        ("frobs_core:frobs/PandaOpenDrawer-v0", (0.4, 0.0, 0.4), "has no goal that can be moved"),
        ("frobs_core:frobs/KobukiEmpty-v0", (1e3, 0.0, 0.0), "outside the floor plan"),
    ],
)
def test_goals_that_cannot_be_are_refused_in_one_line(id: str, goal: tuple[float, float, float], text: str) -> None:
    env = gym.make(id)
    env.reset(seed=0)
    with pytest.raises(ConfigurationError, match=text) as caught:
        env.unwrapped.task.set_goal(np.array([goal]))  # type: ignore[attr-defined]
    assert "\n" not in str(caught.value)
    env.close()

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_rl_compat.gazebo.launch import find_world
from frobs_rl_compat.replacements import has_original
from frobs_rl_compat.ros import ros_gazebo
from frobs_rl_compat.ros.backends import Launch, check, choose, command
from frobs_ros.ros import master, processes
from frobs_ros.ros.services import is_offered

PACKAGES = Path(__file__).parent / "packages"
BRIDGE = "bridge:mujoco"


def test_the_backend_is_chosen_by_variable_then_parameter_then_by_what_is_here(
    own_master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = master.connect()
    assert choose() == ("gazebo" if has_original("gazebo_ros") else "bridge:mujoco")
    server.setParam("/FROBS_ROS_BACKEND", "bridge:pybullet")
    try:
        assert choose() == "bridge:pybullet"
        monkeypatch.setenv("FROBS_ROS_BACKEND", "gazebo")
        assert choose() == "gazebo"
        monkeypatch.setenv("FROBS_ROS_BACKEND", "webots")
        with pytest.raises(ConfigurationError, match="FROBS_ROS_BACKEND is 'webots'"):
            choose()
    finally:
        server.deleteParam("/FROBS_ROS_BACKEND")


@pytest.mark.parametrize(
    ("launch", "words"),
    [
        (Launch(paused=True), ["--paused"]),
        (Launch(verbose=True), ["--verbose"]),
        (Launch(clock_frequency=250), ["--clock-frequency", "250"]),
        (Launch(world=Path("/a.world")), ["--world", "/a.world"]),
        (Launch(debug=True), ["-X", "faulthandler"]),
    ],
)
def test_arguments_of_a_launch_reach_the_bridge(launch: Launch, words: list[str]) -> None:
    given, variables = command(launch, "bridge:pybullet")
    assert given[0] == sys.executable
    assert given[given.index("--simulator") + 1] == "pybullet"
    assert any(given[i : i + len(words)] == words for i in range(len(given)))
    assert ("FROBS_DEBUG" in variables) >= launch.debug


def test_arguments_of_a_launch_reach_gazebo(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "gzserver").write_text("#!/bin/sh\n")
    (tmp_path / "gzserver").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":7")
    launch = Launch(paused=True, recording=True, debug=True, verbose=True, world=Path("/a.world"), respawn=True,
                    clock_frequency=50, use_sim_time=False)  # fmt: skip
    words, _ = command(launch, "gazebo")
    assert words[:3] == ["roslaunch", "gazebo_ros", "empty_world.launch"]
    assert {
        "paused:=true", "use_sim_time:=false", "gui:=true", "recording:=true", "debug:=true", "verbose:=true",
        "world_name:=/a.world", "respawn_gazebo:=true", "pub_clock_frequency:=50", "server_required:=false",
        "gui_required:=false",
    } <= set(words)  # fmt: skip


@pytest.mark.parametrize(
    ("launch", "backend", "reason"),
    [
        (Launch(recording=True), BRIDGE, "recording is not supported by the backend 'bridge:mujoco'"),
        (Launch(gui_required=True), BRIDGE, "gui_required is not supported"),
        (Launch(clock_frequency=-1), "gazebo", "pub_clock_frequency is -1"),
        (Launch(respawn=True, server_required=True), "gazebo", "cannot be combined"),
        (Launch(gui=False, gui_required=True), "gazebo", "gui_required needs gui"),
    ],
)
def test_what_a_backend_cannot_do_is_refused(
    launch: Launch, backend: str, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":7")
    with pytest.raises(ConfigurationError, match=reason):
        check(launch, backend)


def test_worlds_are_found_by_path_and_by_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(PACKAGES))
    file = PACKAGES / "tiny_arm" / "worlds" / "box.world"
    assert find_world(None, None, None) is None
    assert find_world(str(file), "ignored", "ignored") == file
    assert find_world(None, "tiny_arm", "box.world") == file


@pytest.mark.ros_feature("world files", "mujoco")
def test_a_simulation_is_launched_as_told_and_closed(own_master: str, reasons: Callable[[], str]) -> None:
    import rospy

    given: dict[str, Any] = {"paused": True, "gui": True, "use_sim_time": False, "output": "log", "verbose": True}
    given |= {"custom_world_pkg": "tiny_arm", "custom_world_name": "box.world", "pub_clock_frequency": 50}
    assert ros_gazebo.close_Gazebo() is False
    assert "no simulation was closed, because this process has not launched one" in reasons()
    assert ros_gazebo.launch_Gazebo(**given) is True
    assert "no display is available" in reasons()
    assert rospy.get_param("/use_sim_time") is False
    assert ros_gazebo.gazebo_get_model_state("box_of_the_world")[3] is True
    assert ros_gazebo.close_Gazebo() is True
    assert processes.owned(["gazebo"]) == []
    rospy.delete_param("/use_sim_time")


@pytest.mark.slow
def test_a_launch_that_fails_is_refused_and_leaves_nothing(
    own_master: str, reasons: Callable[[], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FROBS_ROS_BACKEND", "bridge:no_such_simulator")
    assert ros_gazebo.launch_Gazebo(gui=False, output="log") is False
    assert "no simulator is named 'no_such_simulator'" in reasons()
    assert ros_gazebo.launch_Gazebo(output="paper") is False
    assert "output is 'paper'" in reasons()
    assert processes.owned(["gazebo"]) == []
    assert not is_offered("/gazebo/pause_physics")

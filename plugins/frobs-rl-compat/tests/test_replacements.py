"""What the replacements of ROS packages accept and reject; tests of whole launch files are in frobs-rl-compat."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from frobs_core.util.errors import FrobsError
from frobs_rl_compat import replacements
from frobs_rl_compat.replacements import REPLACEMENTS, expand, server, spawn_model

ARM = Path(__file__).parent / "packages" / "tiny_arm"


@pytest.fixture(autouse=True)
def on_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FROBS_ROS_BACKEND", "bridge:mujoco")


def test_the_server_takes_the_arguments_of_the_launch_file() -> None:
    launch, backend = server.read(["--paused", "true", "--gui", "True", "--headless", "false", "worlds/empty.world"])
    assert (launch.paused, launch.gui, launch.world, backend) == (True, True, None, "bridge:mujoco")
    assert server.read(["--gui", "true", "--headless", "1"])[0].gui is False
    assert server.read(["--use-clock-frequency", "false", "--clock-frequency", "50"])[0].clock_frequency == 0
    assert server.read(["--use-clock-frequency", "true", "--clock-frequency", "50"])[0].clock_frequency == 50


def test_worlds_are_found_by_path_and_in_the_resource_path(monkeypatch: pytest.MonkeyPatch) -> None:
    world = ARM / "worlds" / "box.world"
    assert server.find_world(str(world)) == world
    monkeypatch.setenv("GAZEBO_RESOURCE_PATH", f"/nowhere:{ARM}")
    assert server.find_world("worlds/box.world") == world


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["--physics", "bullet"], "physics is 'bullet'; it must be 'ode'"),
        (["--ros-network", "false"], "enable_ros_network is False"),
        (["--recording", "true"], "recording is not supported"),
        (["--use-clock-frequency", "true", "--clock-frequency", "-1"], "pub_clock_frequency is -1"),
        (["no.world"], "no.world does not exist; pass the absolute path of a world file, or set GAZEBO_RESOURCE_PATH"),
    ],
)
@pytest.mark.ros_feature(
    "recording, physics other than ode, and enable_ros_network:=false in empty_world.launch", "replacement", works=False
)
def test_what_the_bridge_cannot_do_is_rejected(given: list[str], message: str) -> None:
    with pytest.raises(FrobsError) as caught:
        server.read(given)
    assert message in str(caught.value)


def test_the_original_gazebo_needs_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FROBS_ROS_BACKEND", "gazebo")
    with pytest.raises(
        FrobsError, match="requires the ROS package gazebo_ros, which is not installed; choose 'bridge:gaz"
    ):
        server.read([])


@pytest.mark.parametrize("given", [["--paused", "perhaps"], ["--lockstep"]])
def test_unknown_arguments_end_the_server(given: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        server.read(given)
    assert caught.value.code == 2


@pytest.mark.parametrize(
    "given", [["-urdf", "-param", "p"], ["-urdf", "-model", "m"], ["-model", "m", "-param", "p"], ["-urdf", "-sdf"]]
)
def test_spawn_model_needs_a_format_a_source_and_a_name(given: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["spawn_model", *given, "__name:=spawn"])
    with pytest.raises(SystemExit) as caught:
        spawn_model.main()
    assert caught.value.code == 2


@pytest.mark.ros_feature("xacro", "replacement")
def test_xacro_prints_or_writes_the_urdf(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ARM.parent))
    file = str(ARM / "urdf" / "arm.urdf.xacro")
    monkeypatch.setattr(sys, "argv", ["xacro", "--inorder", file, "length:=0.7"])
    assert expand.main() == 0
    text = capsys.readouterr().out
    assert 'xyz="0 0 0.7"' in text
    monkeypatch.setattr(sys, "argv", ["xacro", "-o", str(tmp_path / "arm.urdf"), file, "length:=0.7"])
    assert expand.main() == 0
    assert (tmp_path / "arm.urdf").read_text() == text
    monkeypatch.setattr(sys, "argv", ["xacro", "none.xacro"])
    assert expand.main() == 1
    assert "the file does not exist" in capsys.readouterr().err


def test_replacements_are_offered_only_for_packages_that_are_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "xacro").mkdir()
    (tmp_path / "xacro" / "package.xml").write_text("<package><name>xacro</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{REPLACEMENTS}:{tmp_path}")
    monkeypatch.setattr(replacements, "PACKAGES", ("gazebo_ros", "xacro"))
    assert replacements.has_original("gazebo_ros") is False
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}:{REPLACEMENTS}")
    assert replacements.missing_packages() == [REPLACEMENTS / "gazebo_ros"]


def test_every_stand_in_is_a_package_whose_programs_can_be_started() -> None:
    assert sorted(path.parent.name for path in REPLACEMENTS.glob("*/package.xml")) == sorted(replacements.PACKAGES)
    programs = [path for path in REPLACEMENTS.glob("*/**/*") if path.is_file() and path.read_bytes().startswith(b"#!")]
    assert len(programs) == 6
    assert all(os.access(path, os.X_OK) for path in programs)

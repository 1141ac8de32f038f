from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from frobs_rl_compat.ros import ros_urdf

ARM = Path(__file__).parent / "packages" / "tiny_arm" / "urdf" / "arm.urdf.xacro"


@pytest.fixture(autouse=True)
def package_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ARM.parents[2]))


@pytest.mark.ros_feature("xacro", "replacement")
def test_a_xacro_is_expanded_with_its_arguments_and_without_ros() -> None:
    text = ros_urdf.urdf_parse_from_path(str(ARM), ["length:=0.7"])
    assert text is not None
    assert '<origin xyz="0 0 0.7"/>' in text
    assert text == ros_urdf.urdf_parse_from_pkg("tiny_arm", "arm.urdf.xacro", args_xacro=["length:=0.7"])


@pytest.mark.parametrize("ns", [None, "/robot1"])
@pytest.mark.ros_feature("helper functions of FRobs_RL", "ros")
def test_a_description_is_loaded_into_a_parameter(own_master: str, ns: str | None) -> None:
    import rospy

    assert ros_urdf.urdf_load_from_pkg("tiny_arm", "arm.urdf.xacro", "robot_description", ns=ns) is True
    name = f"{ns or ''}/robot_description"
    assert rospy.get_param(name) == ros_urdf.urdf_parse_from_path(str(ARM))
    assert ros_urdf.urdf_load_from_path(str(ARM), "robot_description", ns, ["length:=0.5"]) is True
    assert "0 0 0.5" in rospy.get_param(name)


@pytest.mark.parametrize(
    ("text", "args", "reason"),
    [
        (None, None, "the file does not exist"),
        ("<robot name='a'><link name='b'></robot>", None, "not well-formed"),
        ("<robot name='a'/>", ["length=3"], "'length=3'; it must be of the form"),
        ("<robot name='a'/>", "length:=3", "a list of 'name:=value'"),
        ("<robot name='a'/>", ["length:=3"], "has no xacro argument 'length'"),
    ],
)
def test_a_file_that_is_no_robot_is_refused_with_a_reason(
    tmp_path: Path, reasons: Callable[[], str], text: str | None, args: list[str] | None, reason: str
) -> None:
    file = tmp_path / "robot.urdf"
    if text is not None:
        file.write_text(text)
    assert ros_urdf.urdf_parse_from_path(str(file), args) is None
    assert reason in reasons()


def test_sdf_is_expanded_too(tmp_path: Path) -> None:
    file = tmp_path / "model.sdf"
    file.write_text("<sdf version='1.6'><model name='wall'/></sdf>")
    text = ros_urdf.urdf_parse_from_path(str(file))
    assert text is not None
    assert '<model name="wall"' in text


def test_a_package_without_the_file_is_refused_and_what_it_has_named(reasons: Callable[[], str]) -> None:
    assert ros_urdf.urdf_parse_from_pkg("tiny_arm", "arm.xacro") is None
    assert "Did you mean 'arm.urdf.xacro'?" in reasons()


def test_without_a_master_nothing_is_loaded(lonely: str, reasons: Callable[[], str]) -> None:
    assert ros_urdf.urdf_load_from_path(str(ARM), "robot_description") is False
    assert "no ROS master responds" in reasons()

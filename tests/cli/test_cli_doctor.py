from __future__ import annotations

import dataclasses
import json
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from typer.testing import Result

from frobs_cli import output
from frobs_devkit.cli import doctor_report
from frobs_devkit.doctor import RobotReport, examine_robot

Frobs = Callable[..., Result]
IRB120 = "frobs_robots_abb:models/irb120.urdf.xacro"
BARE = '<robot name="bare"><link name="base"/></robot>'


@pytest.fixture
def bare(tmp_path: Path) -> str:
    path = tmp_path / "bare.urdf"
    path.write_text(BARE)
    return str(path)


def keys_of(cls: Any) -> set[str]:
    return {field.name for field in dataclasses.fields(cls)}


def check(value: Any, annotation: Any) -> None:
    """Compare JSON with the dataclasses that document it."""
    if dataclasses.is_dataclass(annotation):
        assert set(value) == keys_of(annotation)
        hints = typing.get_type_hints(annotation)
        for name, item in value.items():
            check(item, hints[name])
    elif typing.get_origin(annotation) is tuple and dataclasses.is_dataclass(typing.get_args(annotation)[0]):
        for item in value:
            check(item, typing.get_args(annotation)[0])


def test_json_has_the_keys_of_the_documented_classes(frobs: Frobs) -> None:
    result = frobs("doctor", "robot", IRB120, "--json")
    assert result.exit_code == 0, result.stderr
    report = json.loads(result.stdout)
    check(report, RobotReport)
    assert report["format"] == 1
    assert [joint["name"] for joint in report["joints"] if joint["drive"]] == [f"joint_{i}" for i in range(1, 7)]
    assert {"error", "warning", "note"} >= {finding["severity"] for finding in report["findings"]}


def test_a_robot_that_cannot_be_used_exits_with_1(frobs: Frobs, bare: str) -> None:
    result = frobs("doctor", "robot", bare)
    assert result.exit_code == 1
    assert "the robot has no movable joint" in result.stdout
    assert "cannot be used" in result.stdout
    assert frobs("doctor", "robot", bare, "--json").exit_code == 1


@pytest.mark.parametrize("text", ["<robot", "", '<robot name="r"/>'], ids=["broken", "empty", "no links"])
def test_a_file_that_cannot_be_read_exits_with_2_and_one_line(frobs: Frobs, tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.urdf"
    path.write_text(text)
    result = frobs("doctor", "robot", str(path))
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith(f"error: {path}")
    assert result.stderr.count("\n") == 1


def test_xacro_arguments_and_packages_are_given_on_the_line(frobs: Frobs, tmp_path: Path) -> None:
    package = tmp_path / "elsewhere" / "my_parts"
    package.mkdir(parents=True)
    (package / "tri.stl").write_text(
        "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"
    )
    folder = tmp_path / "robots" / "deep" / "down"
    folder.mkdir(parents=True)
    file = folder / "arm.urdf.xacro"
    file.write_text(
        '<robot name="$(arg called)" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="called" default="bob"/>'
        '<link name="base"><visual><geometry><mesh filename="package://my_parts/tri.stl"/></geometry></visual></link></robot>'
    )
    for way in (f"my_parts={package}", str(package), str(package.parent)):
        result = frobs("doctor", "robot", str(file), "--args", "called:=anna", "--package-path", way, "--json")
        report = json.loads(result.stdout)
        assert report["name"] == "anna"
        assert not [f for f in report["findings"] if f["code"] == "unresolved-mesh"]


@pytest.mark.parametrize("option", [("--args", "nothing"), ("--package-path", "/nowhere")])
def test_wrong_options_say_what_they_take(frobs: Frobs, bare: str, option: tuple[str, str]) -> None:
    result = frobs("doctor", "robot", bare, *option)
    assert result.exit_code == 2
    assert option[0] in result.stderr


@pytest.mark.parametrize("width", [60, 80, 120])
def test_the_report_fits_the_terminal(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    consoles: list[Console] = []

    def narrow(**_: Any) -> Console:
        import io

        consoles.append(
            Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None, highlight=False)
        )
        return consoles[-1]

    monkeypatch.setattr(output, "console", narrow)
    monkeypatch.setattr(doctor_report, "console", narrow)
    doctor_report.print_report(examine_robot(IRB120, simulators=("mujoco",)))
    lines = "".join(console.file.getvalue() for console in consoles).splitlines()  # type: ignore[attr-defined]
    assert max(map(len, lines)) <= width
    shown = "\n".join(lines)
    for heading in ("joints", "drives", "links", "mujoco", "findings"):
        assert heading in shown


def test_many_findings_of_one_kind_are_told_together(frobs: Frobs, tmp_path: Path) -> None:
    links = "".join(
        f'<link name="l{i}"><inertial><mass value="1"/><inertia ixx="9" iyy="9" izz="9"/></inertial>'
        '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>'
        for i in range(10)
    )
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="0 0 0.2"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="900"/></joint>'
        for i in range(9)
    )
    path = tmp_path / "many.urdf"
    path.write_text(f'<robot name="many">{links}{joints}</robot>')
    result = frobs("doctor", "robot", str(path))
    assert result.exit_code == 0
    assert "likewise link 'l1'" in result.stdout
    assert "and 3 more" in result.stdout
    assert "10 warnings" in result.stdout


def test_the_family_alone_shows_its_help(frobs: Frobs) -> None:
    assert frobs("doctor").stdout == frobs("doctor", "--help").stdout


def test_a_misspelt_examination_suggests_the_right_one(frobs: Frobs) -> None:
    result = frobs("doctor", "robto")
    assert result.exit_code == 2
    assert "Did you mean 'robot'?" in result.stderr


def test_a_file_can_be_shown(frobs: Frobs, bare: str) -> None:
    [facts] = json.loads(frobs("show", bare, "--json").stdout)
    assert (facts["kind"], facts["name"], facts["dof"]) == ("robot file", "bare", 0)
    missing = frobs("show", "nowhere.urdf")
    assert missing.exit_code == 2
    assert "the file does not exist" in missing.stderr


def test_only_robots_have_pictures(frobs: Frobs, tmp_path: Path) -> None:
    result = frobs("show", "reach", "--picture", str(tmp_path / "reach.png"))
    assert result.exit_code == 2
    assert "'reach' cannot be drawn, because it is neither" in result.stderr
    assert not (tmp_path / "reach.png").exists()


@pytest.mark.needs("rendering")
def test_the_pictures_of_all_cameras_are_drawn(frobs: Frobs, tmp_path: Path) -> None:
    import matplotlib.image

    file = tmp_path / "cameras.png"
    result = frobs("show", "frobs/PandaPickAndPlaceVision-v0", "--cameras", str(file))
    assert result.exit_code == 0, result.stderr
    assert matplotlib.image.imread(file).shape == (72 + 2 * (400 + 64) + 24, 3 * (400 + 24) + 24, 4)
    for words, message in (
        (("irb120", "--cameras", str(file)), "an environment ID is required, but 'irb120' is none"),
        (("frobs/PandaPush-v0", "--cameras", str(tmp_path / "cameras.jpg")), "a file name that ends in .png"),
    ):
        result = frobs("show", *words)
        assert result.exit_code == 2
        assert message in " ".join(result.stderr.split())


def test_the_pictures_for_a_policy_have_the_markers_that_it_observes(tmp_path: Path) -> None:
    import matplotlib.image

    from frobs_devkit.camera_sheet import draw_camera_sheet

    def draw(markers: bool) -> Any:
        eye = {"camera": "overview", "size": [64, 64], "markers": markers}
        keywords = {"simulator": "pybullet", "observations": {"eye": eye}}
        file = draw_camera_sheet("frobs_core:frobs/Irb120Reach-v0", keywords, tmp_path / f"{markers}.png")
        return matplotlib.image.imread(file)

    differs, middle = (draw(True) != draw(False)).any(axis=(1, 2)), 72 + 64 + 400
    assert not differs[:middle].any()
    assert differs[middle:].any()


def test_a_machine_without_opengl_is_told_what_to_install(
    frobs: Frobs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from frobs_core.util.errors import RenderingUnavailableError
    from frobs_devkit.robot_sheet.stage import Stage

    def no_opengl(*_: Any) -> None:
        raise RenderingUnavailableError("there is no OpenGL (EGL or OSMesa) on this machine", "libegl1 libgl1-mesa-dri")

    monkeypatch.setattr(Stage, "draw", no_opengl)
    result = frobs("show", "irb120", "--picture", str(tmp_path / "irb120.png"))
    assert result.exit_code == 2
    [line] = [line for line in result.stderr.splitlines() if line.startswith("error:")]
    assert "apt-get install libegl1 libgl1-mesa-dri" in line
    assert not (tmp_path / "irb120.png").exists()


def test_a_registered_robot_is_examined_by_its_name(frobs: Frobs) -> None:
    result = frobs("doctor", "robot", "irb120", "--simulator", "mujoco", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["dof"] == 6


def test_the_verdict_names_the_simulators_that_lack_something(frobs: Frobs, tmp_path: Path) -> None:
    file = tmp_path / "arm.xml"
    arm = '<body name="arm" gravcomp="1"><joint name="j"/><geom type="capsule" fromto="0 0 0 0 0 1" size=".1"/></body>'
    file.write_text(f'<mujoco><worldbody><body name="base"><geom size=".1"/>{arm}</body></worldbody></mujoco>')
    options = ("--simulator", "mujoco", "--simulator", "pybullet")
    result = frobs("doctor", "robot", str(file), *options)
    assert result.exit_code == 0, result.stderr
    assert "this robot can be used on mujoco, with limits on pybullet" in result.stdout
    assert "does not fully support gravity compensation (arm), which changes the robot's motion" in " ".join(
        result.stdout.split()
    )
    file.write_text(file.read_text().replace("</mujoco>", '<actuator><motor joint="j"/></actuator></mujoco>'))
    file.write_text(
        file.read_text().replace(
            "</body></worldbody>", '<body name="b"><joint name="k"/><geom size=".1"/></body></body></worldbody>'
        )
    )
    result = frobs("doctor", "robot", str(file), *options)
    assert "this robot can be used on mujoco, but not on pybullet" in result.stdout
    assert "only simulator='mujoco' simulates passive joints" in " ".join(result.stdout.split())


def test_the_advice_of_a_simulator_without_its_engine_is_printed_once(
    frobs: Callable[..., Result], installed: Callable[[str, str], None]
) -> None:
    installed("frobs-zz-engine", WITHOUT_ENGINE)
    text = frobs("doctor", "robot", "irb120").stdout
    assert text.count("Install it with apt-get install zz-engine") == 1
    assert "'zz' cannot be used: the engine ZZ is not available. Install it with apt-get install zz-engine.\n" in text
    assert ".." not in text.partition("the engine ZZ")[2].partition("\n")[0]


WITHOUT_ENGINE = """
from frobs_core.util.errors import SimulationError
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import SimulatorRecord


def __getattr__(name):
    if name == "Zz":
        raise SimulationError("the engine ZZ is not available. Install it with apt-get install zz-engine.")
    raise AttributeError(name)


@hookimpl
def frobs_simulators():
    return [SimulatorRecord(name="zz", summary="an engine", entry_point=f"{__name__}:Zz", capabilities={},
                            install_hint="pip install frobs-zz-engine")]
"""

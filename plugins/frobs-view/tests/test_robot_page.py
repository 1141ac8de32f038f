"""The page of a robot file, and the command."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from frobs_cli.program import program
from frobs_core.models import Inertial, Pose, inertia_matrix
from frobs_core.plugins.registry import pretrained_path
from frobs_core.util.rotations import matrix_from_quat
from frobs_view import RobotPage, ViewServer
from frobs_view.robot import _line, _mass_table, equivalent_box
from frobs_view.shapes import triangles

URDF = """<robot name="swing">
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <link name="arm&lt;b&gt;">
    <inertial><origin xyz="0 0 0.2"/><mass value="2"/>
      <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 0.2"/><geometry><mesh filename="rod.stl"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/></material></visual>
    <collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.02" length="0.4"/></geometry></collision>
  </link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="arm&lt;b&gt;"/><axis xyz="0 1 0"/>
    <origin xyz="0 0 0.05"/><limit lower="-1" upper="2" effort="0" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A robot with a mesh, a strange name and a joint whose drive has no effort."""
    trimesh.creation.cylinder(0.02, 0.4).export(tmp_path / "rod.stl")
    path = tmp_path / "swing.urdf"
    path.write_text(URDF)
    return path


@pytest.fixture
def page(file: Path) -> Iterator[RobotPage]:
    with closing(ViewServer()) as server:
        yield RobotPage(str(file), server)


def test_sliders_move_the_links_within_their_limits(page: RobotPage) -> None:
    [slider] = page._sliders
    assert (slider.min, slider.max) == (-1.0, 2.0)
    slider.value = 0.5
    page._read_sliders()
    arm = page._drawing.nodes[1]
    np.testing.assert_allclose(arm.position, (0.0, 0.0, 0.05), atol=1e-9)
    np.testing.assert_allclose(arm.wxyz, (np.cos(0.25), 0.0, np.sin(0.25), 0.0), atol=1e-9)
    page.move(page._home)
    np.testing.assert_allclose(arm.wxyz, (1.0, 0.0, 0.0, 0.0), atol=1e-9)


def test_meshes_and_colors_are_those_of_the_file(page: RobotPage) -> None:
    [rod] = triangles([part for part in page._drawing._parts if part.name.endswith("visual0") and "arm" in part.frame])
    assert rod.rgba == (1.0, 0.0, 0.0, 1.0)
    np.testing.assert_allclose(rod.vertices.min(axis=0), (-0.02, -0.02, 0.0), atol=1e-3)
    np.testing.assert_allclose(rod.vertices.max(axis=0), (0.02, 0.02, 0.4), atol=1e-3)


def test_findings_are_shown_at_the_link_that_they_concern(page: RobotPage) -> None:
    [finding] = [each for each in page.report.findings if "hinge" in each.about][:1]
    names = [name for name in page._server.scene._handle_from_node_name if "/finding" in name]
    assert any(name.startswith("/frame1/finding") for name in names)
    label = next(name for name in names if name.startswith("/frame1/finding") and not name.endswith("dot"))
    assert finding.code in page._server.scene._handle_from_node_name[label].text


def test_masses_are_shown_on_demand(page: RobotPage) -> None:
    assert page._masses == []
    page._show_masses(True)
    assert [node.visible for node in page._masses] == [True, True]
    page._show_masses(False)
    assert [node.visible for node in page._masses] == [False, False]


def test_texts_of_the_file_cannot_write_html(page: RobotPage) -> None:
    assert "arm\\<b\\>" in _mass_table(page.report)
    assert "<b>" not in "".join(map(_line, page.report.findings))


def test_the_box_of_an_inertia_has_this_inertia() -> None:
    inertial = Inertial(3.0, Pose((0.0, 0.0, 0.1), (0.9238795, 0.3826834, 0.0, 0.0)), (0.05, 0.0, 0.0, 0.04, 0.0, 0.02))
    (x, y, z), quat = equivalent_box(inertial)
    moments = 3.0 / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    turn = matrix_from_quat(quat)
    np.testing.assert_allclose(turn @ np.diag(moments) @ turn.T, inertia_matrix(inertial), atol=1e-6)


@pytest.mark.parametrize(
    "words",
    [
        ["{file}"],
        ["ur5"],
        ["{bundle}"],
        ["frobs/Irb120Reach-v0", "--policy", "{bundle}", "--num-envs", "2"],
        ["frobs/KobukiEmpty-v0", "--simulator", "pybullet"],
    ],
    ids=["file", "robot", "bundle", "policies", "pybullet"],
)
def test_the_command_prints_one_address(words: list[str], file: Path) -> None:
    bundle = pretrained_path("frobs/Irb120Reach-v0")
    result = run(*[word.format(file=file, bundle=bundle) for word in words], "--seconds", "0.5")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("http://localhost:")
    assert result.stdout.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["frobs/Irb120Reach-v1"], "Irb120Reach-v0"),
        (["CartPole-v1"], "is not an environment of FRobs"),
        (["absent.urdf"], "absent.urdf"),
        (["ur5", "--follow"], "only a run folder can be followed"),
        (["ur5", "--simulator", "pybullet", "--seed", "1"], "--simulator and --seed and ur5 cannot be combined"),
        (["frobs/Irb120Reach-v0", "--follow", "--seconds", "5"], "only a run folder can be followed"),
        (["frobs/Irb120Reach-v0", "--policy", "exprt"], "expert"),
        (["frobs/Irb120Reach-v0", "--host", "0.0.0.0"], "one address or name"),
    ],
)
def test_mistakes_are_one_clear_error(words: list[str], text: str) -> None:
    result = run(*words, "--seconds", "1")
    assert result.exit_code in (1, 2)
    assert text in " ".join(result.stderr.split())


def run(*words: str) -> Any:
    return CliRunner().invoke(program(), ["view", *words], prog_name="frobs")

"""``frobs new``: what it makes, asks, and refuses."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from runpy import run_path

import pytest
import trimesh
from gripper_arms import arm, robot, two_fingers
from typer.testing import CliRunner, Result

from frobs_cli.program import program
from frobs_core.description import Robot
from frobs_core.models import Mesh, find_reader, load_model
from frobs_devkit.cli import new as module
from frobs_models import read_mesh

Frobs = Callable[..., Result]
FAULTY = """<robot name="faulty"><link name="a"/><link name="b"/>
<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint></robot>"""


@pytest.fixture
def frobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Frobs:
    """Run a command in an empty folder."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")

    def run(*args: str, input: str | None = None) -> Result:
        return CliRunner().invoke(program(), list(args), prog_name="frobs", input=input)

    return run


def test_it_says_what_it_made_and_what_is_next(frobs: Frobs) -> None:
    done = frobs("new", "pair", "my_arm", "--namespace", "acme", "--json")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert facts["folder"] == "my-arm"
    assert facts["distributions"] == ["frobs-robots-my-arm", "frobs-tasks-my-arm"]
    assert facts["environment_id"] == "acme/MyArmReach-v0"
    assert len(facts["next"]) == 4
    assert facts["next"][0] == (
        "pip install -e 'my-arm/frobs-robots-my-arm[test]' -e 'my-arm/frobs-tasks-my-arm[test]'"
    )
    assert all((Path("my-arm") / file).is_file() for file in facts["files"])


def test_people_get_the_commands_to_copy(frobs: Frobs) -> None:
    done = frobs("new", "both", "my_rover", "--example", "wheeled", "--output", "deep/er")
    assert done.exit_code == 0, done.output
    assert "    pytest deep/er/frobs-my-rover\n" in done.stdout


def test_a_paced_simulator_is_run_and_not_trained_on(frobs: Frobs) -> None:
    done = frobs("new", "simulator", "my_robot", "--paced", "--json")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert facts["answers"]["paced"] == "yes"
    assert "train.yaml" not in facts["files"]
    assert facts["next"][-1] == "frobs evaluate frobs/Irb120Reach-v0 --pretrained --simulator my_robot --episodes 10"
    assert facts["next"][-1] in Path("frobs-sim-my-robot/README.md").read_text()
    record = Path("frobs-sim-my-robot/src/frobs_sim_my_robot/plugin.py").read_text()
    assert '"real_time": Level.APPROXIMATE' in record
    assert 'teleport"' not in record
    assert (
        '"frobs-sim-mujoco>=' in Path("frobs-sim-my-robot/pyproject.toml").read_text().partition("[project.optional")[0]
    )


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["pair", "class"], "Python keyword"),
        (["pair", "match"], "Python keyword"),
        (["pair", "My-Arm"], "lowercase letters"),
        (["pair", "2arms"], "lowercase letters"),
        (["pair", "my__arm"], "lowercase letters"),
        (["pair", "a" * 41], "41 characters"),
        (["robots", "my_arm"], "must be one of pair, both"),
        (["pair", "my_arm", "--example", "legged"], "must be one of arm, wheeled, file"),
        (["pair", "my_arm", "--license", "GPL"], "must be one of MIT"),
        (["pair", "my_arm", "--namespace", "frobs"], "reserved for FRobs"),
        (["pair", "my_arm", "--namespace", "a/b"], "letters, digits"),
        (["pair", "my_arm", "--author", 'A "B" C'], "without quotes"),
        (["pair", "my_arm", "--example", "file"], "robot_file is empty"),
        (["task", "my_reach", "--robot-file", "arm.urdf"], "a task alone cannot use a robot from a file"),
        (["controller", "my_controller", "--tcp", "tool0"], "tcp does not apply to a new controller"),
        (["controller", "my_controller", "--paced"], "paced does not apply to a new controller"),
        (["robot", "irb120"], "the robot 'irb120' already exists"),
        (
            ["controller", "joint_position"],
            "the controller 'joint_position' already exists: frobs-controllers 0.3.0 provides it",
        ),
        (["simulator", "mujoco"], "the distribution 'frobs-sim-mujoco' already exists: version 0.3.0 is installed"),
        (["robot", "abb"], "the distribution 'frobs-robots-abb' already exists: version 0.3.0 is installed"),
        (["task", "my_reach", "--robot", "irb121"], "Did you mean 'irb120'?"),
        (["task", "my_drive", "--example", "wheeled", "--robot", "irb120"], "has no differential drive"),
        (["task", "scene", "--robot", "irb120"], "the class 'Scene' of the new plugin would hide an imported one"),
        (["task", "my_drive", "--example", "wheeled"], "'frobs list robots'"),
        (["pair", "my_arm", "--robot-file", "missing.urdf"], "the file does not exist"),
        (["pair", "my_arm", "--robot-file", "faulty.urdf"], "faulty.urdf"),
        (["pair", "my_arm", "--robot-file", "broken.urdf"], "broken.urdf"),
    ],
    ids=lambda value: " ".join(value)[:60] if isinstance(value, list) else "",
)
def test_it_refuses_in_one_line_and_writes_nothing(frobs: Frobs, args: list[str], words: str) -> None:
    Path("faulty.urdf").write_text(FAULTY)
    Path("broken.urdf").write_text("<robot name='x'><link")
    before = sorted(Path().iterdir())
    done = frobs("new", *args)
    assert done.exit_code == 2, done.output
    assert done.stderr.startswith("error: ")
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr
    assert sorted(Path().iterdir()) == before


def test_a_link_that_is_not_there_is_refused_with_the_nearest(frobs: Frobs, tiny_arm: Path) -> None:
    done = frobs("new", "pair", "tiny", "--robot-file", str(tiny_arm), "--tcp", "tol")
    assert done.exit_code == 2
    assert "Did you mean 'tool'?" in done.stderr
    assert list(Path().iterdir()) == []


def test_a_folder_that_exists_is_left_alone(frobs: Frobs) -> None:
    Path("my-arm").mkdir()
    Path("my-arm/mine.txt").write_text("mine")
    done = frobs("new", "pair", "my_arm")
    assert done.exit_code == 2
    assert "my-arm exists" in done.stderr
    assert [path.as_posix() for path in Path().rglob("*")] == ["my-arm", "my-arm/mine.txt"]


def test_what_fails_half_way_leaves_nothing(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device", "x")

    monkeypatch.setattr("frobs_devkit.scaffold.rendering.finish_robot", fail)
    done = frobs("new", "pair", "my_arm")
    assert done.exit_code == 2
    assert "No space left" in done.stderr
    assert list(Path().iterdir()) == []


def test_a_script_that_says_too_little_is_told(frobs: Frobs) -> None:
    done = frobs("new", "pair")
    assert done.exit_code == 2
    assert "frobs new pair my_arm" in done.stderr


def test_a_terminal_is_asked_and_told_what_will_not_do(frobs: Frobs, monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal:
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(module, "sys", type("sys", (), {"stdin": Terminal()}))
    lines = ["both", "wheeled", "lambda", "my_rover", "", "", "", ""]
    answers = iter(lines)
    monkeypatch.setattr(module.typer, "prompt", lambda text, default, err: next(answers) or default)
    done = frobs("new")
    assert done.exit_code == 0, done.output
    assert "Python keyword" in done.stderr
    assert "a wheeled robot that drives to a goal" in done.stderr
    assert Path("frobs-my-rover/pyproject.toml").is_file()
    assert list(answers) == []


@pytest.fixture
def tiny_arm(tmp_path: Path) -> Path:
    """An arm of one joint, with meshes of one name in two folders."""
    mesh = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex {0} 0 0\nvertex 0 {0} 0\nendloop\nendfacet\nendsolid s\n"
    for i, folder in enumerate(("one", "two"), start=1):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "shape.stl").write_text(mesh.format(0.01 * i))
    body = (
        '<inertial><origin xyz="0.1 0 0"/><mass value="1"/>'
        '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
        '<collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.05 0.05"/></geometry></collision>'
    )
    visual = '<visual><geometry><mesh filename="{}/shape.stl"/></geometry></visual>'
    file = tmp_path / "tiny.urdf"
    file.write_text(
        f'<robot name="tiny"><link name="base">{body}{visual.format("one")}</link>'
        f'<link name="arm">{body}{visual.format("two")}</link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.3"/>'
        '<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="20"/></joint>'
        '<link name="tool"/><joint name="mount" type="fixed"><parent link="arm"/><child link="tool"/>'
        '<origin xyz="0.3 0 0"/></joint></robot>'
    )
    return file


def test_a_robots_file_is_taken_over_with_all_that_it_names(frobs: Frobs, tiny_arm: Path) -> None:
    done = frobs("new", "robot", "tiny", "--robot-file", str(tiny_arm))
    assert done.exit_code == 0, done.output
    package = Path("frobs-robots-tiny/src/frobs_robots_tiny")
    text = (package / "tiny.urdf").read_text()
    assert 'filename="meshes/shape.stl"' in text
    assert 'filename="meshes/2/shape.stl"' in text
    assert (package / "meshes/2/shape.stl").read_bytes() == tiny_arm.with_name("two").joinpath("shape.stl").read_bytes()
    assert str(tiny_arm.parent) not in text
    description = (package / "robot.py").read_text()
    assert 'tcp="tool"' in description
    assert "``turn``: revolute, -2 to 2" in description


def test_files_that_meshes_name_keep_their_content(tmp_path: Path) -> None:
    from frobs_devkit.scaffold.robot_file import copy_model

    visual = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
    for folder, color in (("one", "1 0 0"), ("two", "0 1 0")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "look.mtl").write_text(f"newmtl look\nKd {color}\n")
        (tmp_path / folder / f"{folder}.obj").write_text(
            "mtllib look.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl look\nf 1 2 3\n"
        )
    for name, content in trimesh.Scene(trimesh.creation.box((0.1, 0.1, 0.1))).export(file_type="gltf").items():
        (tmp_path / "two" / name).write_bytes(content)
    meshes = "".join(map(visual.format, ("one/one.obj", "two/two.obj", "two/model.gltf")))
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="a">{meshes}</link></robot>')
    copy_model(load_model(tmp_path / "r.urdf"), tmp_path / "copy" / "r.urdf")
    one, two, box = (shape.geometry for shape in load_model(tmp_path / "copy" / "r.urdf").links[0].visuals)
    assert isinstance(one, Mesh)
    assert isinstance(two, Mesh)
    assert isinstance(box, Mesh)
    assert [part.rgba for mesh in (one, two) for part in read_mesh(mesh.path)] == [(1, 0, 0, 1), (0, 1, 0, 1)]
    assert len(read_mesh(box.path)[0].faces) == 12
    (tmp_path / "sky.png").write_bytes(b"")
    sky = '<asset><texture name="sky" type="skybox" fileup="sky.png"/></asset>'
    (tmp_path / "r.xml").write_text(f'<mujoco>{sky}<worldbody><body><geom size=".1"/></body></worldbody></mujoco>')
    copy_model(load_model(tmp_path / "r.xml"), tmp_path / "copy" / "r.xml")
    assert 'fileup="meshes/sky.png"' in (tmp_path / "copy" / "r.xml").read_text()


def test_a_file_on_which_the_kit_fails_is_rejected_before_anything_is_written(frobs: Frobs, tiny_arm: Path) -> None:
    tiny_arm.write_text(tiny_arm.read_text().replace('lower="-2" upper="2"', 'lower="-114" upper="114"'))
    done = frobs("new", "robot", "tiny", "--robot-file", str(tiny_arm))
    assert done.exit_code == 2, done.output
    assert len(done.stderr.splitlines()) == 1
    assert "limits_are_in_radians: joint 'turn': the joint limits are -114 and 114 rad" in done.stderr
    assert "--failing-checks expect" in done.stderr
    assert list(Path().iterdir()) == []


def test_failures_of_the_kit_can_be_accepted(frobs: Frobs, tiny_arm: Path) -> None:
    tiny_arm.write_text(tiny_arm.read_text().replace('lower="-2" upper="2"', 'lower="-114" upper="114"'))
    done = frobs("new", "robot", "tiny", "--robot-file", str(tiny_arm), "--failing-checks", "expect")
    assert done.exit_code == 0, done.output
    tests = [path.read_text() for path in Path("frobs-robots-tiny/tests").glob("*.py")]
    assert any('"limits_are_in_radians": "joint' in text for text in tests)


def test_the_license_of_a_robots_file_is_its_own(frobs: Frobs, tiny_arm: Path) -> None:
    package = Path("frobs-robots-tiny/src/frobs_robots_tiny")
    done = frobs("new", "robot", "tiny", "--robot-file", str(tiny_arm), "--author", "Ada")
    assert done.exit_code == 0, done.output
    assert "No license was found" in (package / "MODEL_LICENSE").read_text()
    own = Path("frobs-robots-tiny/LICENSE").read_text()
    assert "Copyright (c) Ada" in own
    assert "does not apply to the robot's model file" in " ".join(own.split())
    assert "No license was found" in Path("frobs-robots-tiny/README.md").read_text()


def test_the_license_of_a_robots_file_is_copied(frobs: Frobs, tiny_arm: Path) -> None:
    from frobs_devkit.scaffold.robot_file import find_license

    (tiny_arm.parent / "package.xml").write_text("<package><license>BSD</license></package>")
    assert "BSD" in find_license(tiny_arm)[1]
    (tiny_arm.parent / "LICENSE.txt").write_text("Copyright of the vendor")
    done = frobs("new", "robot", "tiny", "--robot-file", str(tiny_arm))
    assert done.exit_code == 0, done.output
    assert Path("frobs-robots-tiny/src/frobs_robots_tiny/MODEL_LICENSE").read_text() == "Copyright of the vendor"


def test_the_gripper_of_a_robot_file_is_filled_in(frobs: Frobs, tmp_path: Path) -> None:
    file = tmp_path / "grasper.urdf"
    file.write_text(robot(arm(4), two_fingers()))
    done = frobs("new", "robot", "grasper", "--robot-file", str(file), "--failing-checks", "expect")
    assert done.exit_code == 0, done.output
    source = Path("frobs-robots-grasper/src/frobs_robots_grasper")
    described = run_path(str(source / "robot.py"))["GRASPER"]
    expected = find_reader(file).with_gripper(Robot(model=str(file), name="grasper"))
    for name in ("groups", "default_controllers", "end_effectors", "friction", "self_collision", "tcp"):
        assert getattr(described, name) == getattr(expected, name), name
    assert described.home == {"left": 0.04}
    assert described.gains.of("left") == pytest.approx(expected.gains.of("left"), rel=1e-5)
    assert [link.name for link in described.read_model().links] == [link.name for link in expected.read_model().links]
    assert all(
        str(path).startswith("meshes/")
        for path in re.findall('filename="(.*?)"', (source / "grasper.urdf").read_text())
    )

"""Objects from files in place of the cube: what is read, how it is grasped, and that the expert brings it to the goal."""

from __future__ import annotations

import importlib
import logging
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import trimesh
from expert_runs import made, success_rate
from gripper_arms import arm, robot, two_fingers
from object_meshes import MADE, write

from frobs_core.util.errors import ConfigurationError, ModelFileError
from frobs_models import read_object
from frobs_tasks_manipulation.own_object import OwnObject
from frobs_tasks_manipulation.pick_and_place import PickAndPlace

PANDA = "frobs_core:frobs/PandaPickAndPlace-v0"
BOX = '<robot name="b"><link name="a"><collision><geometry><box size="{}"/></geometry></collision></link>{}</robot>'


def own(**keywords: Any) -> OwnObject:
    found = PickAndPlace(**keywords).own_object
    assert found is not None
    return found


def test_mass_and_inertia_come_from_volume_and_density(tmp_path: Path) -> None:
    trimesh.creation.box((40.0, 60.0, 20.0)).export(tmp_path / "box.stl")
    read = read_object(tmp_path / "box.stl", scale=0.001)
    assert read.mass == pytest.approx(0.048)
    assert np.diag(read.inertia) == pytest.approx(0.048 / 12 * np.array([4e-3, 2e-3, 5.2e-3]), rel=1e-6)
    assert read_object(tmp_path / "box.stl", scale=0.001, mass=0.1).mass == 0.1


def test_the_fingers_close_across_the_narrow_side(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.03, 0.05)).export(tmp_path / "box.obj")
    found = own(object=str(tmp_path / "box.obj")).found
    assert np.abs(found.rotation[:, 1]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert found.rotation[:, 2] == pytest.approx([0.0, 0.0, 1.0])
    assert abs(found.pos[0]) < 0.02  # [m] from the center of mass
    assert found.top == pytest.approx(0.05)


def test_an_object_that_would_fall_over_is_put_on_another_side(tmp_path: Path) -> None:
    trimesh.creation.box((0.012, 0.03, 0.08)).export(tmp_path / "plate.stl")
    assert own(object=str(tmp_path / "plate.stl")).found.top == pytest.approx(0.012, abs=1e-4)


def test_the_frame_of_the_object_is_where_the_tool_grips_it(tmp_path: Path) -> None:
    with made(PANDA, num_envs=2, object=str(write("bracket", tmp_path)), object_mass=0.05) as env:
        env.reset(seed=0)
        task: Any = env.task
        assert task.mass == 0.05
        assert task.cube.pos[:, 2] == pytest.approx(task.rest_height)
        for _ in range(20):
            env.step(np.zeros(env.action_space.shape))
        assert task.cube.pos[:, 2] == pytest.approx(task.rest_height, abs=1e-3)  # it rests on the floor


@pytest.mark.parametrize("given", [{"size": 0.05}, {"mass": 0.2}])
def test_the_size_and_the_mass_of_the_cube_cannot_be_set_for_an_object(tmp_path: Path, given: dict[str, Any]) -> None:
    with pytest.raises(
        ConfigurationError, match=f"object and {next(iter(given))} cannot be combined; .* has no effect"
    ):
        gym.make(PANDA, object=str(write("bracket", tmp_path)), **given)


def test_a_scale_that_fits_is_suggested_and_works(tmp_path: Path) -> None:
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(radius=0.06).export(path)
    with pytest.raises(ConfigurationError, match="cannot be grasped from above") as raised:
        PickAndPlace(object=str(path))
    assert "gap is 0 to 80 mm" in str(raised.value)
    scale = re.search(r"object_scale=([\d.]+) \(option --object-scale\)", str(raised.value))
    assert scale is not None
    assert own(object=str(path), object_scale=float(scale[1])).found.width <= 0.074


def test_a_mesh_in_millimeters_names_the_scale(tmp_path: Path) -> None:
    path = write("nut", tmp_path, scale=1000.0)
    with pytest.raises(
        ModelFileError, match=r"34.54 m long.* set object_scale=0\.001; object_scale=0\.0029 .* makes it 10 cm"
    ):
        PickAndPlace(object=str(path))
    assert own(object=str(path), object_scale=0.001).model.mass == pytest.approx(0.0066, rel=0.02)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("empty.stl", "", "broken or empty|is empty|broken"),
        ("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n", "a coordinate is not finite"),
        ("cut.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0", "the mesh is broken"),
        ("part.step", "ISO-10303-21;", r"suffix '\.step' are not supported"),
        ("nothing.urdf", '<robot name="a"><link name="a"/></robot>', "the object has no shapes"),
        (
            "hinge.urdf",
            BOX.format(
                "1 1 1", '<link name="c"/><joint name="j" type="continuous"><parent link="a"/><child link="c"/></joint>'
            ),
            "an object must be rigid, but the joint 'j' moves",
        ),
    ],
)
def test_an_unsuitable_file_is_refused_with_one_line(tmp_path: Path, name: str, content: str, reason: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(ModelFileError, match=reason) as raised:
        PickAndPlace(object=str(tmp_path / name))
    assert "\n" not in str(raised.value)


def test_a_flat_or_tiny_object_is_refused(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [0.05, 0, 0], [0.05, 0.05, 0], [0, 0.05, 0]])
    trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]]).export(tmp_path / "flat.stl")
    with pytest.raises(ModelFileError, match="the object is flat"):
        PickAndPlace(object=str(tmp_path / "flat.stl"))
    trimesh.creation.box((0.03, 0.03, 0.03)).export(tmp_path / "box.stl")
    with pytest.raises(ModelFileError, match=r"the object is 3e-05 mm long, .* set a larger object_scale"):
        PickAndPlace(object=str(tmp_path / "box.stl"), object_scale=1e-6)


def test_options_of_the_object_need_a_file() -> None:
    with pytest.raises(ConfigurationError, match="set object=FILE"):
        PickAndPlace(object_mass=0.1)
    with pytest.raises(ConfigurationError, match="object_scale is -1"):
        PickAndPlace(object="nut.stl", object_scale=-1.0)


def test_an_open_surface_gives_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    box = trimesh.creation.box((0.04, 0.04, 0.04))
    box.update_faces(np.arange(12) > 1)
    box.export(tmp_path / "open.stl")
    mesh = trimesh.load_mesh(tmp_path / "open.stl")
    assert isinstance(mesh, trimesh.Trimesh)
    assert not mesh.is_volume
    read = read_object(tmp_path / "open.stl")
    assert read.mass == pytest.approx(0.064, rel=0.05)
    (message,) = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert "the surface is not closed" in message


def test_the_expert_picks_and_places_an_object(tmp_path: Path) -> None:
    with made(PANDA, num_envs=20, object=str(write("mug", tmp_path))) as env:
        assert success_rate(env) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", list(MADE))
def test_an_arm_from_a_file_picks_and_places_objects(tmp_path: Path, name: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(robot(arm(), two_fingers()))
    with made(
        "frobs_core:frobs/PickAndPlace-v0", num_envs=30, robot=str(path), object=str(write(name, tmp_path))
    ) as env:
        assert success_rate(env) >= 0.9


@pytest.mark.slow
@pytest.mark.needs("pybullet")
@pytest.mark.parametrize("name", ["lego/lego.urdf", "duck_vhacd.urdf", "random_urdfs/000/000.urdf"])
def test_public_objects_are_lifted(name: str) -> None:
    data = importlib.import_module("pybullet_data")
    path = Path(data.getDataPath()) / name
    with made("frobs_core:frobs/PandaLift-v0", num_envs=20, object=str(path)) as env:
        assert success_rate(env) >= 0.9


@pytest.mark.needs("pybullet")
def test_another_simulator_holds_the_object(tmp_path: Path) -> None:
    env: Any = gym.make(PANDA, simulator="pybullet", object=str(write("nut", tmp_path)))
    env.reset(seed=0)
    for _ in range(5):
        env.step(env.action_space.sample())
    assert env.unwrapped.task.cube.pos[0, 2] == pytest.approx(env.unwrapped.task.rest_height, abs=2e-3)
    env.close()

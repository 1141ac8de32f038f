"""Model files of all kinds on MuJoCo: meshes, masses, overlaps, and files that mean harm."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import Pose, load_model
from frobs_sim_mujoco.building import build_model
from frobs_sim_mujoco.simulation import MujocoSimulation

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="10"/>'


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, parent: str, child: str, origin: str = "0 0 0", kind: str = "revolute") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{origin}"/><axis xyz="0 1 0"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{LIMIT}</joint>'


def shape(tag: str, geometry: str, origin: str = "0 0 0") -> str:
    return f'<{tag}><origin xyz="{origin}"/><geometry>{geometry}</geometry></{tag}>'


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., dict[str, Placement]]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def write(*elements: str, **fields: object) -> dict[str, Placement]:
        path = tmp_path / "r.urdf"
        path.write_text(f'<robot name="r">\n{chr(10).join(elements)}\n</robot>')
        robot = Robot(model=str(path), **fields)
        return {"robot": Placement(robot=robot, model=load_model(path), pose=Pose(), command_mode=CommandMode.POSITION)}

    return write


def compiled(robots: dict[str, Placement], *, visuals: bool = False) -> mujoco.MjModel:
    return build_model(robots, Scene(floor=False), 0.002, visuals=visuals)[0]


@pytest.mark.parametrize("name", ["m.dae", "m.obj", "m.stl", "ascii.stl", "m.glb", "m.ply"])
def test_a_mesh_of_any_format_collides_as_its_hull(tmp_path, place, name):
    kind = "stl_ascii" if name == "ascii.stl" else name.partition(".")[2]
    trimesh.creation.box((0.2, 0.4, 0.6)).export(tmp_path / name, file_type=kind)
    model = compiled(
        place(link("a", INERTIAL + shape("collision", f'<mesh filename="{name}" scale="1 -2 1"/>', "0 0 1")))
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    points = data.geom_xpos[0] + model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T
    assert points.min(axis=0) == pytest.approx((-0.1, -0.4, 0.7), abs=1e-6)
    assert points.max(axis=0) == pytest.approx((0.1, 0.4, 1.3), abs=1e-6)


def test_a_visual_has_the_colours_of_its_mesh_or_else_of_the_file(tmp_path, place):
    tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    faces = ("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", "f 5 7 6\nf 5 6 8\nf 5 8 7\nf 6 7 8\n")
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 1 0 0\n")
    (tmp_path / "m.obj").write_text(
        f"mtllib m.mtl\no plain\n{tetrahedron}{faces[0]}o red\n{tetrahedron}usemtl red\n{faces[1]}"
    )
    blue = '<material name="blue"><color rgba="0 0 1 1"/></material>'
    drawn = f'<visual><geometry><mesh filename="m.obj"/></geometry>{blue}</visual>'
    model = compiled(place(link("a", INERTIAL + drawn)), visuals=True)
    assert sorted(model.geom_rgba.tolist()) == [[0, 0, 1, 1], [1, 0, 0, 1]]
    assert model.nmeshface == 8


def test_what_the_file_does_not_weigh_weighs_nothing(place):
    ball = shape("collision", '<sphere radius="0.5"/>')
    model = compiled(
        place(link("a"), link("b"), link("tool", ball), joint("j", "a", "b"), joint("t", "b", "tool", kind="fixed"))
    )
    assert model.body("robot/tool").mass[0] == 0.0
    assert model.body("robot/b").subtreemass[0] == 1.0


def test_a_mesh_without_thickness_is_drawn_and_collides_as_a_plate(tmp_path, place):
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).export(tmp_path / "flat.stl")
    flat = '<mesh filename="flat.stl"/>'
    assert compiled(place(link("a", INERTIAL + shape("visual", flat))), visuals=True).ngeom == 1
    assert compiled(place(link("a", INERTIAL + shape("collision", flat)))).ngeom == 1


def test_links_that_are_in_each_other_at_home_let_each_other_be(place):
    ball = INERTIAL + shape("collision", '<sphere radius="0.3"/>')
    chain = [*(link(n, ball) for n in "abcd"), *(joint(f"j{p}", p, c, "0 0 0.4") for p, c in ("ab", "bc", "cd"))]
    far = place(*chain)
    near = place(*(element.replace('xyz="0 0 0.4"', 'xyz="0 0 0.25"') for element in chain))
    assert compiled(far).nexclude == 0
    assert compiled(near).nexclude == 2  # a and c, b and d; neighbours never touch
    simulation = MujocoSimulation(near, Scene(floor=False), num_envs=1, physics_timestep=0.002)
    assert {(o.first, o.second) for o in simulation.overlaps()} == {("a", "c"), ("b", "d")}
    simulation.step(500)
    assert np.abs(simulation.robots["robot"].joint_positions).max() < 1e-3
    simulation.close()


def test_a_long_chain_is_built(place):
    links = [link(f"l{i}") for i in range(450)]
    joints = [joint(f"j{i}", f"l{i}", f"l{i + 1}", "0 0 0.01") for i in range(449)]
    assert compiled(place(*links, *joints)).nv == 449

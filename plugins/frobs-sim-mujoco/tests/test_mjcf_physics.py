"""A robot from an MJCF file has the physics that MuJoCo gives the file itself, or FRobs reports the difference."""

from __future__ import annotations

import logging
from pathlib import Path

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import inertia_matrix, load_model
from frobs_core.util.errors import ModelFileError, SimulationError
from frobs_sim_mujoco.simulation import MujocoSimulation

ARM = """<mujoco model="arm"><compiler {compiler}/><option {option}>{flag}</option>
<default><joint damping="0.1" armature="0.01"/></default>
<worldbody><body name="base"><inertial pos="0 0 0" mass="0.5" diaginertia="1e-3 1e-3 1e-3"/><geom type="box" size=".05 .05 .05" contype="0" conaffinity="0"/>
  <body name="upper" pos="0 0 .05" gravcomp="{gravcomp}"><joint name="shoulder" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 .05 0 0 .3" size=".03"/>
    <body name="lower" pos="0 0 .35"><joint name="elbow" axis="0 1 0" stiffness="2" springref="30"/>
      <inertial pos="0 0 .1" mass="0.05" diaginertia="1e-5 1e-5 3e-5"/><geom type="ellipsoid" pos="0 0 .15" size=".03 .02 .1"/>
    </body></body></body></worldbody>{sections}</mujoco>"""


def write(
    tmp_path: Path, compiler: str = "", option: str = "", flag: str = "", gravcomp: float = 0.0, sections: str = ""
) -> Path:
    path = tmp_path / "arm.xml"
    text = ARM.format(compiler=compiler, option=option, flag=flag, gravcomp=gravcomp, sections=sections)
    path.write_text(text.replace("1e-5 1e-5 3e-5", "1e-5 1e-5 1.5e-5") if "balance" not in compiler else text)
    return path


def build(path: Path, **options: object) -> MujocoSimulation:
    placement = Placement(robot=Robot(model=str(path)), model=load_model(path), command_mode=CommandMode.EFFORT)
    return MujocoSimulation({"robot": placement}, Scene(floor=False), num_envs=1, physics_timestep=0.002, **options)


SETTINGS = {
    "settotalmass": 'settotalmass="14"',
    "boundmass": 'boundmass="0.2"',
    "boundinertia": 'boundinertia="0.002"',
    "inertiafromgeom": 'inertiafromgeom="true"',
    "balanceinertia": 'balanceinertia="true"',
    "all": 'settotalmass="14" boundmass="0.2" boundinertia="0.002" inertiafromgeom="true"',
}


@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass' is deprecated")
@pytest.mark.parametrize("compiler", SETTINGS.values(), ids=SETTINGS)
def test_masses_are_those_that_the_files_compiler_settings_give(tmp_path, compiler):
    path = write(tmp_path, compiler)
    expected, built = mujoco.MjModel.from_xml_path(str(path)), build(path).model
    links = {link.name: link.inertial for link in load_model(path).links}
    for name in ("base", "upper", "lower"):
        theirs, ours = expected.body(name), built.body(f"robot/{name}")
        assert ours.mass == pytest.approx(theirs.mass, rel=1e-9)
        assert np.sort(ours.inertia) == pytest.approx(np.sort(theirs.inertia), rel=1e-9)
        assert links[name].mass == pytest.approx(theirs.mass[0], rel=1e-9)  # PyBullet and Gazebo use these
        moments = np.linalg.eigvalsh(inertia_matrix(links[name]))
        assert moments == pytest.approx(np.sort(theirs.inertia), rel=1e-6)


@pytest.mark.parametrize("settings", [{}, {"gravcomp": 0.5}, {"option": 'density="1000" viscosity="0.5" wind="1 0 0"'}])
def test_the_robot_moves_as_in_bare_mujoco(tmp_path, settings):
    path = write(tmp_path, **settings)
    options = {"density": 1000.0, "viscosity": 0.5, "wind": [1.0, 0.0, 0.0]} if "option" in settings else {}
    simulation = build(path, **options)
    simulation.robots["robot"].write_joint_state(np.array([[0.3, -0.4]]))
    simulation.step(250)
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep, model.opt.integrator = 0.002, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(model)
    data.qpos[:] = [0.3, -0.4]
    mujoco.mj_step(model, data, 250)
    assert simulation.robots["robot"].joint_positions[0] == pytest.approx(data.qpos, abs=1e-9)


def test_settings_of_the_physics_that_are_left_out_are_reported(tmp_path, caplog):
    option = (
        'timestep="0.005" gravity="0 0 -1.6" density="1.2" viscosity="0" impratio="10" cone="elliptic" wind="0 0 0"'
    )
    path = write(tmp_path, option=option, flag='<flag contact="disable" warmstart="disable"/>')
    (note,) = [note for note in load_model(path).notes if note.rule == "physics-settings"]
    assert note.fault
    assert note.text == "gravity=0 0 -1.6, density=1.2, impratio=10, cone=elliptic, contact=disable: ignored"
    with caplog.at_level(logging.WARNING, "frobs"):
        gym.make("frobs/Reach-v0", robot=str(path), controller="joint_delta_position").close()
    assert "does not move exactly as its model file specifies: gravity=0 0 -1.6" in caplog.text


def test_only_joints_with_an_actuator_of_the_file_get_a_drive(tmp_path):
    path = write(tmp_path, sections='<actuator><motor joint="shoulder" gear="7"/></actuator>')
    model = load_model(path)
    assert (model.joint_names, model.passive_joints) == (("shoulder",), ("elbow",))
    simulation = build(path)
    assert simulation.model.nu == 1
    simulation.step(250)
    assert simulation.native.batch.bind("qpos")[0, 1] > 0.05  # the spring pulls the joint that has no drive


def test_links_between_the_joints_of_one_body_are_frames(tmp_path):
    path = tmp_path / "two.xml"
    joints = '<joint name="pan" axis="0 0 1"/><joint name="tilt" axis="0 1 0"/>'
    path.write_text(
        f'<mujoco><worldbody><body name="base"><geom size=".1"/><body name="head" pos="0 0 .2">{joints}'
        '<geom type="box" size=".1 .05 .05"/></body></body></worldbody></mujoco>'
    )
    simulation = build(path)
    robot = simulation.robots["robot"]
    assert robot.joint_names == ("pan", "tilt")
    assert robot.frame_pose("head")[0][0] == pytest.approx([0.0, 0.0, 0.2])
    robot.write_joint_state(np.array([[0.5, 0.3]]))
    for link in ("head", "head__1"):
        pos, quat = robot.frame_pose(link)
        expected_pos, expected_quat = robot.planned_frame_pose(link, robot.joint_positions)
        assert pos == pytest.approx(expected_pos, abs=1e-12)
        assert quat == pytest.approx(expected_quat, abs=1e-12)
    assert robot.frame_jacobian("head__1")[0, 3:] == pytest.approx(np.array([[0, 0], [0, 0], [1, 0]]), abs=1e-12)
    with pytest.raises(SimulationError, match="link 'head__1' is between the joints of one MJCF body"):
        robot.frame_velocity("head__1")


@pytest.mark.parametrize("name", ["half_cheetah", "humanoid", "swimmer", "walker2d_v5", "pusher"])
def test_robots_of_gymnasium_whose_bodies_have_several_joints_make_an_environment(name):
    path = Path(gym.__file__).parent / "envs" / "mujoco" / "assets" / f"{name}.xml"
    env = gym.make("frobs/Reach-v0", robot=str(path), controller="joint_delta_position")
    env.reset(seed=0)
    env.unwrapped.step(env.action_space.sample())
    env.close()


@pytest.mark.parametrize("shape", ["", '<geom type="box" size=".01 .01 .01" mass="0"/>'], ids=["bare", "shape"])
def test_a_body_without_mass_has_its_center_of_mass_at_its_origin(tmp_path, shape):
    path = write(tmp_path)
    tool = f'<body name="tool" pos="0 0 .2">{shape}</body>'
    path.write_text(path.read_text().replace("</body></body></body>", f"{tool}</body></body></body>"))
    simulation = build(path)
    assert simulation.model.body("robot/tool").ipos == pytest.approx(np.zeros(3), abs=1e-12)
    simulation.close()


def test_an_impossible_file_is_a_model_file_error(tmp_path):
    path = write(tmp_path, 'settotalmass="14" balance=""')
    with pytest.raises(ModelFileError, match="MuJoCo rejects"):
        build(path)

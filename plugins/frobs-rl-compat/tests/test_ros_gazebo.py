"""Every function of ros_gazebo against the bridge over MuJoCo and over a real Gazebo."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from frobs_rl_compat.gazebo import physics
from frobs_rl_compat.ros import ros_gazebo

SDF = Path(__file__).parent / "packages" / "tiny_arm" / "sdf" / "ball.sdf"
URDF = SDF.parents[1] / "urdf" / "arm.urdf.xacro"
BOX = (
    '<robot name="box"><link name="link"><inertial><mass value="1"/>'
    '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>'
)

pytestmark = pytest.mark.usefixtures("world")


def sim_time() -> float:
    from gazebo_msgs.srv import GetWorldProperties

    from frobs_ros.ros.services import call

    return float(call("/gazebo/get_world_properties", GetWorldProperties).sim_time)


@pytest.fixture
def defaults(world: None) -> object:
    yield  # type: ignore[misc]
    assert ros_gazebo.gazebo_set_default_properties()


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_update_rate_is_a_real_time_factor_and_outlives_a_time_step(defaults: None) -> None:
    assert ros_gazebo.gazebo_set_max_update_rate(5) is True
    assert ros_gazebo.gazebo_get_max_update_rate() == pytest.approx(5.0)
    assert ros_gazebo.gazebo_set_time_step(0.002) is True
    assert ros_gazebo.gazebo_get_time_step() == pytest.approx(0.002)
    assert ros_gazebo.gazebo_get_max_update_rate() == pytest.approx(5.0)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_time_step_that_is_none_is_refused(value: float, reasons: Callable[[], str]) -> None:
    assert ros_gazebo.gazebo_set_time_step(value) is False
    assert "new_time_step is" in reasons()


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_gravity_is_set_and_read(defaults: None) -> None:
    assert ros_gazebo.gazebo_set_gravity(0.1, 0.2, -1.6) is True
    found = ros_gazebo.gazebo_get_gravity()
    assert (found.x, found.y, found.z) == pytest.approx((0.1, 0.2, -1.6))


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_the_engines_settings_are_those_that_are_given(defaults: None) -> None:
    assert ros_gazebo.gazebo_set_ODE_physics(True, 1, 60, 1.2, 0.1, 0.002, 90.0, 0.01, 0.3, 10) is True
    found = ros_gazebo.gazebo_get_ODE_physics()
    assert found.sor_pgs_iters == 60
    assert (found.erp, found.max_contacts) == (pytest.approx(0.3), 10)


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_the_default_properties_are_frobs_rls(defaults: None) -> None:
    ros_gazebo.gazebo_set_time_step(0.003)
    assert ros_gazebo.gazebo_set_default_properties() is True
    assert ros_gazebo.gazebo_get_time_step() == pytest.approx(0.001)
    assert ros_gazebo.gazebo_get_max_update_rate() == pytest.approx(1.0)
    assert ros_gazebo.gazebo_get_gravity().z == pytest.approx(-9.81)
    found = ros_gazebo.gazebo_get_ODE_physics()
    assert {name: getattr(found, name) for name in physics.ODE} == pytest.approx(physics.ODE)


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_steps_are_made_when_the_answer_comes() -> None:
    ros_gazebo.gazebo_pause_physics()
    before = sim_time()
    assert ros_gazebo.gazebo_step_physics(25) is True
    assert sim_time() - before == pytest.approx(0.025, abs=1e-9)


@pytest.mark.parametrize("steps", [0, -3, 1.5, True])
def test_a_number_of_steps_that_is_none_is_refused(steps: int, reasons: Callable[[], str]) -> None:
    assert ros_gazebo.gazebo_step_physics(steps) is False
    assert "steps is" in reasons()


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_time_runs_while_it_is_not_paused() -> None:
    before = sim_time()
    assert ros_gazebo.gazebo_unpause_physics() is True
    time.sleep(0.1)
    assert ros_gazebo.gazebo_pause_physics() is True
    paused = sim_time()
    assert paused > before
    time.sleep(0.05)
    assert sim_time() == paused


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_resets_put_models_back_and_one_of_them_the_clock() -> None:
    ros_gazebo.gazebo_spawn_urdf_string(BOX, "box", pos_z=2.0)
    for reset, keeps_the_clock in ((ros_gazebo.gazebo_reset_world, True), (ros_gazebo.gazebo_reset_sim, False)):
        ros_gazebo.gazebo_step_physics(200)
        before = sim_time()
        assert ros_gazebo.gazebo_get_model_state("box")[1].position.z < 1.9
        assert reset() is True
        assert ros_gazebo.gazebo_get_model_state("box")[1].position.z == pytest.approx(2.0, abs=1e-6)
        assert (sim_time() == before) is keeps_the_clock
    assert sim_time() == 0.0


@pytest.mark.parametrize("way", ["string", "path", "pkg", "param"])
@pytest.mark.parametrize("kind", ["urdf", "sdf"])
@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_models_come_by_each_way_and_go(kind: str, way: str) -> None:
    import rospy

    file, folder = (URDF, "/urdf") if kind == "urdf" else (SDF, "sdf")
    text = BOX if kind == "urdf" else file.read_text()
    rospy.set_param("/a_model", text)
    given = {"string": [text], "path": [str(file)], "pkg": ["tiny_arm", file.name, folder], "param": ["/a_model"]}[way]
    spawn = getattr(ros_gazebo, f"gazebo_spawn_{kind}_{way}")
    assert spawn(*given, model_name="it", pos_x=1.0) == (True, "SpawnModel: Successfully spawned entity")
    assert ros_gazebo.gazebo_get_model_state("it")[3] is True
    assert ros_gazebo.gazebo_delete_model("it") is True
    assert ros_gazebo.gazebo_get_model_state("it") == (None, None, None, False)


def test_a_name_cannot_be_taken_twice(reasons: Callable[[], str]) -> None:
    assert ros_gazebo.gazebo_spawn_urdf_string(BOX, "box")[0]
    assert ros_gazebo.gazebo_spawn_urdf_string(BOX, "box") == (False, "SpawnModel: Failure - entity already exists.")
    assert "entity already exists" in reasons()
    assert ros_gazebo.gazebo_get_model_state("box")[3]


@pytest.mark.parametrize("text", ["<robot name='a'", "<robot name='a'><joint name='j' type='revolute'/></robot>", ""])
def test_an_invalid_model_is_refused_and_the_world_goes_on(text: str) -> None:
    done, reason = ros_gazebo.gazebo_spawn_urdf_string(text, "invalid")
    assert done is False
    assert reason
    assert ros_gazebo.gazebo_get_model_state("invalid")[3] is False
    assert ros_gazebo.gazebo_step_physics(1)


@pytest.mark.parametrize(
    ("spawn", "given", "reason"),
    [
        (ros_gazebo.gazebo_spawn_urdf_path, ["/no/such.urdf"], "the file does not exist"),
        (ros_gazebo.gazebo_spawn_sdf_path, ["/no/such.sdf"], "cannot be read"),
        (ros_gazebo.gazebo_spawn_urdf_pkg, ["no_package", "a.urdf"], "no ROS package is named"),
        (ros_gazebo.gazebo_spawn_sdf_pkg, ["tiny_arm", "none.sdf"], "has no file"),
        (ros_gazebo.gazebo_spawn_urdf_param, ["/not_there"], "there is no parameter"),
    ],
)
def test_what_is_missing_is_refused_as_a_pair(
    spawn: Callable[..., tuple[bool, str]], given: list[str], reason: str
) -> None:
    done, said = spawn(*given)
    assert done is False
    assert reason in said


@pytest.mark.ros_feature("helper functions of FRobs_RL", "mujoco", "gazebo")
def test_a_model_is_put_somewhere_and_four_zeros_turn_nothing() -> None:
    ros_gazebo.gazebo_spawn_urdf_string(BOX, "box", pos_z=1.0)
    assert ros_gazebo.gazebo_set_model_state("box", pos_x=2.0, pos_z=3.0, lin_vel_y=0.5) is True
    _, pose, twist, found = ros_gazebo.gazebo_get_model_state("box", "world")
    assert found
    assert (pose.position.x, pose.position.z, pose.orientation.w) == pytest.approx((2.0, 3.0, 1.0))
    assert twist.linear.y == pytest.approx(0.5)


@pytest.mark.parametrize("given", [{"ori_w": 3.0}, {"ori_x": math.nan}, {"pos_x": math.inf}, {"sleep_time": -1.0}])
def test_a_state_that_is_none_is_refused(given: dict[str, float], reasons: Callable[[], str]) -> None:
    ros_gazebo.gazebo_spawn_urdf_string(BOX, "box")
    assert ros_gazebo.gazebo_set_model_state("box", **given) is False
    assert reasons()


def test_models_that_are_not_there_are_refused(reasons: Callable[[], str]) -> None:
    assert ros_gazebo.gazebo_set_model_state("nobody") is False
    assert ros_gazebo.gazebo_delete_model("nobody") is False
    assert "'nobody'" in reasons()


@pytest.mark.ros_feature("a second simulation on one master", "mujoco", "gazebo", works=False)
def test_a_second_simulation_on_one_master_is_refused(reasons: Callable[[], str]) -> None:
    assert ros_gazebo.launch_Gazebo(gui=False) is False
    assert "a simulation is already connected to the ROS master" in reasons()
    assert ros_gazebo.gazebo_step_physics(1)

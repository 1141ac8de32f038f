"""The services of gazebo_ros, as a client of Gazebo calls them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.parametrize(
    "simulator",
    [
        "mujoco",
        *(pytest.param(name, marks=[pytest.mark.slow, pytest.mark.needs(name)]) for name in ("pybullet", "gazebo")),
    ],
    indirect=True,
    scope="module",
)

INERTIA = '<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
BOX = f'<robot name="box"><link name="b">{INERTIA}<collision><geometry><box size=".2 .2 .2"/></geometry></collision></link></robot>'
ARM = f"""<robot name="arm"><link name="world"/><link name="base">{INERTIA}</link><link name="rod">
<inertial><origin xyz="0 0 0.5"/><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="f" type="fixed"><parent link="world"/><child link="base"/></joint>
<joint name="j" type="continuous"><axis xyz="0 1 0"/><parent link="base"/><child link="rod"/></joint></robot>"""
SPHERE = """<sdf version="1.6"><model name="ball"><link name="l"><inertial><mass>2</mass></inertial>
<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model></sdf>"""


class Gazebo:
    """Calls services by name."""

    def __init__(self) -> None:
        import rospy
        from gazebo_msgs import srv
        from std_srvs.srv import Empty

        from frobs_msgs.srv import StepWorld

        self._rospy, self._srv = rospy, srv
        self._kinds = dict.fromkeys(("pause_physics", "unpause_physics", "reset_world", "reset_simulation"), Empty)
        self._kinds |= {"step": StepWorld, "spawn_urdf_model": srv.SpawnModel, "spawn_sdf_model": srv.SpawnModel}
        self._kinds |= {"clear_joint_forces": srv.JointRequest, "clear_body_wrenches": srv.BodyRequest}

    def __getattr__(self, name: str) -> Callable[..., Any]:
        kind = self._kinds.get(name) or getattr(self._srv, "".join(word.title() for word in name.split("_")))
        return self._rospy.ServiceProxy(f"/gazebo/{name}", kind)

    def spawn(self, name: str, xml: str, x: float = 0.0, z: float = 0.0, frame: str = "") -> Any:
        from geometry_msgs.msg import Pose

        pose = Pose()
        pose.position.x, pose.position.z = x, z  # the quaternion of zeros that clients send
        call = self.spawn_sdf_model if "<sdf" in xml else self.spawn_urdf_model
        return call(name, xml, "", pose, frame)

    def height(self, name: str) -> float:
        return float(self.get_model_state(name, "world").pose.position.z)


@pytest.fixture(scope="module")
def server(simulator: str, bridges: Callable[..., Any]) -> Gazebo:
    bridges("--simulator", simulator, "--paused")
    return Gazebo()


@pytest.fixture
def gazebo(server: Gazebo) -> Gazebo:
    server.pause_physics()
    for name in server.get_world_properties().model_names:
        if name != "ground_plane":
            assert server.delete_model(name).success
    server.reset_simulation()
    return server


@pytest.mark.ros_feature("physics properties", "mujoco", "pybullet", "gazebo")
def test_physics_properties_are_those_of_gazebo(gazebo: Gazebo) -> None:
    told = gazebo.get_physics_properties()
    assert (told.success, told.status_message) == (True, "GetPhysicsProperties: got properties")
    assert (told.time_step, told.max_update_rate, told.gravity.z, told.pause) == (0.001, 1000.0, -9.8, True)
    ode = told.ode_config
    assert (ode.sor_pgs_iters, ode.sor_pgs_w, ode.erp, ode.max_contacts) == (50, 1.3, 0.2, 20)
    assert (ode.contact_surface_layer, ode.contact_max_correcting_vel) == (0.001, 100.0)


def test_logging_asks_the_master_for_nothing(gazebo: Gazebo) -> None:
    import rospy

    assert rospy.get_param("/rosout_disable_topics_generation") is False  # rospy only caches parameters with a value


@pytest.mark.ros_feature("physics properties", "mujoco", "pybullet", "gazebo")
def test_physics_properties_are_kept_and_felt(gazebo: Gazebo) -> None:
    before = gazebo.get_physics_properties()
    gazebo.spawn("box", BOX, z=10.0)
    before.gravity.z = 0.0
    before.ode_config.sor_pgs_iters = 77
    told = gazebo.set_physics_properties(0.002, 500.0, before.gravity, before.ode_config)
    assert (told.success, told.status_message) == (True, "physics engine updated")
    assert gazebo.step(100).time == pytest.approx(0.2)
    assert gazebo.height("box") == pytest.approx(10.0, abs=1e-9)
    now = gazebo.get_physics_properties()
    assert (now.time_step, now.max_update_rate, now.gravity.z, now.ode_config.sor_pgs_iters) == (0.002, 500.0, 0.0, 77)
    before.gravity.z, before.ode_config.sor_pgs_iters = -9.8, 50
    assert gazebo.set_physics_properties(0.001, 1000.0, before.gravity, before.ode_config).success
    gazebo.step(100)
    assert gazebo.height("box") == pytest.approx(10.0 - 0.5 * 9.8 * 0.1**2, rel=1e-2)


@pytest.mark.parametrize("time_step", [0.0, -1.0, math.nan, 1e9])
@pytest.mark.ros_feature("physics properties", "mujoco", "pybullet", "gazebo")
def test_impossible_time_step_is_refused(gazebo: Gazebo, time_step: float) -> None:
    now = gazebo.get_physics_properties()
    told = gazebo.set_physics_properties(time_step, 1000.0, now.gravity, now.ode_config)
    assert not told.success
    assert "time step" in told.status_message
    assert gazebo.get_physics_properties().time_step == 0.001


@pytest.mark.ros_feature("pausing, resuming and stepping", "mujoco", "pybullet", "gazebo")
def test_steps_are_made_before_the_answer(gazebo: Gazebo) -> None:
    assert gazebo.step(10).time == pytest.approx(0.01)
    told = gazebo.step(2500)
    assert (told.success, told.time) == (True, pytest.approx(2.51))
    assert gazebo.get_world_properties().sim_time == pytest.approx(2.51)


@pytest.mark.ros_feature("pausing, resuming and stepping", "mujoco", "pybullet", "gazebo")
def test_time_runs_and_stands_still(gazebo: Gazebo) -> None:
    gazebo.unpause_physics()
    assert not gazebo.get_physics_properties().pause
    start, began = gazebo.get_world_properties().sim_time, time.monotonic()
    time.sleep(1.0)
    gazebo.pause_physics()
    passed, wall = gazebo.get_world_properties().sim_time - start, time.monotonic() - began
    assert 0.3 * wall < passed <= 1.1 * wall + 0.05  # as real time where the machine lets it
    time.sleep(0.1)
    assert gazebo.get_world_properties().sim_time == pytest.approx(start + passed)


LEANING = """<sdf version="1.7"><model name="m"><pose>1 2 0.5 0 0 1.5707963267948966</pose><static>1</static>
<link name="l"><pose>0 0 1 0 0 0</pose><collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>
</link></model></sdf>"""


@pytest.mark.ros_feature("spawning and deleting models", "mujoco", "pybullet", "gazebo")
def test_the_pose_of_an_sdf_model_is_relative_to_the_pose_that_is_asked_for(gazebo: Gazebo) -> None:
    from geometry_msgs.msg import Point, Pose, Quaternion

    pose = Pose(Point(10.0, 0.0, 3.0), Quaternion(0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))  # a quarter turn
    assert gazebo.spawn_sdf_model("leaning", LEANING, "/", pose, "world").success
    told = gazebo.get_model_state("leaning", "world").pose
    assert (told.position.x, told.position.y, told.position.z) == pytest.approx((8.0, 1.0, 3.5))
    assert abs(told.orientation.z) == pytest.approx(1.0)
    gazebo.reset_world()
    assert gazebo.get_model_state("leaning", "world").pose.position.x == pytest.approx(8.0)
    link = gazebo.get_link_state("leaning::l", "world").link_state.pose.position
    assert (link.x, link.y, link.z) == pytest.approx((8.0, 1.0, 4.5))


@pytest.mark.ros_feature("spawning and deleting models", "mujoco", "pybullet", "gazebo")
def test_models_are_spawned_and_deleted(gazebo: Gazebo) -> None:
    for name, xml in (("box", BOX), ("ball", SPHERE)):
        told = gazebo.spawn(name, xml, z=1.0)
        assert (told.success, told.status_message) == (True, "SpawnModel: Successfully spawned entity")
    assert gazebo.get_world_properties().model_names == ["ground_plane", "box", "ball"]
    told = gazebo.delete_model("box")
    assert (told.success, told.status_message) == (True, "DeleteModel: successfully deleted model")
    assert not gazebo.delete_model("box").success
    assert gazebo.height("ball") == pytest.approx(1.0)


@pytest.mark.ros_feature("spawning and deleting models", "mujoco", "pybullet", "gazebo")
def test_name_that_is_taken_is_refused(gazebo: Gazebo) -> None:
    assert gazebo.spawn("box", BOX, z=1.0).success
    told = gazebo.spawn("box", BOX)
    assert (told.success, told.status_message) == (False, "SpawnModel: Failure - entity already exists.")
    assert gazebo.height("box") == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("xml", "words"),
    [
        ("", "empty"),
        ("<robot", "not well-formed"),
        ('<robot name="r"/>', "no <link>"),
        (BOX.replace('size=".2 .2 .2"', 'size="0 0 0"'), "sizes must be > 0"),
        ('<sdf version="1.6"><model name="m"><link name="l"><light/></link></model></sdf>', "<light>"),
        (
            BOX.replace(
                "</robot>", '<gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so"/></gazebo></robot>'
            ),
            "left_joint",
        ),
    ],
    ids=["empty", "torn", "no-link", "no-size", "sdf", "plugin"],
)
@pytest.mark.ros_feature("spawning and deleting models", "mujoco", "pybullet", "gazebo")
def test_invalid_model_is_refused_and_changes_nothing(gazebo: Gazebo, xml: str, words: str) -> None:
    told = gazebo.spawn("bad", xml)
    assert not told.success
    assert told.status_message.startswith("SpawnModel: Failure - ")
    assert words in told.status_message
    assert gazebo.get_world_properties().model_names == ["ground_plane"]
    assert gazebo.step(1).success


@pytest.mark.ros_feature("spawning and deleting models", "mujoco", "pybullet", "gazebo")
def test_spawning_keeps_the_motion_of_what_is_there(gazebo: Gazebo) -> None:
    gazebo.spawn("box", BOX, z=5.0)
    gazebo.spawn("arm", ARM, x=3.0)
    gazebo.set_model_configuration("arm", "", ["j"], [0.5])
    gazebo.step(100)
    before = gazebo.get_model_state("box", "")
    angle = gazebo.get_joint_properties("j")
    assert gazebo.spawn("ball", SPHERE, x=1.0).success
    after = gazebo.get_model_state("box", "")
    assert after.pose.position.z == pytest.approx(before.pose.position.z, abs=1e-12)
    assert after.twist.linear.z == pytest.approx(before.twist.linear.z, abs=1e-9)
    now = gazebo.get_joint_properties("j")
    assert (now.position, now.rate) == (pytest.approx(angle.position), pytest.approx(angle.rate))


@pytest.mark.ros_feature("model states", "mujoco", "pybullet", "gazebo")
def test_model_state_is_set_and_told_in_any_frame(gazebo: Gazebo) -> None:
    from gazebo_msgs.msg import ModelState

    gazebo.spawn("box", BOX, z=2.0)
    gazebo.spawn("ball", SPHERE, x=1.0, z=2.0)
    state = ModelState(model_name="box", reference_frame="world")
    state.pose.position.x, state.pose.position.z = 1.0, 3.0
    state.pose.orientation.z = state.pose.orientation.w = math.sqrt(0.5)
    state.twist.linear.x = 0.5
    assert gazebo.set_model_state(state).success
    told = gazebo.get_model_state("box", "world")
    assert told.twist.linear.x == pytest.approx(0.5, abs=1e-6)
    relative = gazebo.get_model_state("ball", "box")
    assert (relative.pose.position.x, relative.pose.position.z) == (pytest.approx(0.0, abs=1e-6), pytest.approx(-1.0))
    assert relative.twist.linear.y == pytest.approx(0.5, abs=1e-6)  # the box goes to its own right
    assert relative.header.frame_id == "box"
    assert gazebo.spawn("third", SPHERE, x=1.0, frame="box").success
    assert gazebo.get_model_state("third", "").pose.position.y == pytest.approx(1.0)
    for name, frame in (("none", ""), ("box", "none")):
        assert not gazebo.get_model_state(name, frame).success
        assert not gazebo.set_model_state(ModelState(model_name=name, reference_frame=frame)).success


@pytest.mark.ros_feature("model states", "mujoco", "pybullet", "gazebo")
def test_state_that_is_published_is_taken(gazebo: Gazebo) -> None:
    import rospy
    from gazebo_msgs.msg import ModelState

    gazebo.spawn("box", BOX, z=2.0)
    publisher = rospy.Publisher("/gazebo/set_model_state", ModelState, queue_size=1)
    end = time.monotonic() + 10.0
    while gazebo.height("box") < 4.0 and time.monotonic() < end:
        state = ModelState(model_name="box")
        state.pose.position.z = 4.0
        publisher.publish(state)
        time.sleep(0.05)
    assert gazebo.height("box") == pytest.approx(4.0)
    publisher.unregister()


@pytest.mark.ros_feature("resets of the world and of the time", "mujoco", "pybullet", "gazebo")
def test_reset_brings_models_back_and_the_time_where_told(gazebo: Gazebo) -> None:
    gazebo.spawn("box", BOX, z=2.0)
    gazebo.step(500)
    assert gazebo.height("box") < 1.5
    gazebo.reset_world()
    assert gazebo.height("box") == pytest.approx(2.0)
    assert gazebo.get_world_properties().sim_time == pytest.approx(0.5)
    gazebo.step(10)
    gazebo.reset_simulation()
    assert gazebo.height("box") == pytest.approx(2.0)
    assert gazebo.get_world_properties().sim_time == 0.0
    gazebo.step(1)
    assert gazebo.get_model_state("box", "").twist.linear.z == pytest.approx(-0.0098, rel=1e-3)


@pytest.mark.ros_feature("model states", "mujoco", "pybullet", "gazebo")
def test_model_properties_name_its_parts(gazebo: Gazebo) -> None:
    gazebo.spawn("arm", ARM)
    told = gazebo.get_model_properties("arm")
    assert (told.success, told.is_static, told.canonical_body_name) == (True, False, "world")
    assert told.body_names == ["world", "base", "rod"]
    assert told.joint_names == ["f", "j"]
    assert gazebo.get_model_properties("ground_plane").is_static
    assert not gazebo.get_model_properties("none").success


@pytest.mark.ros_feature("joint properties and model configuration", "mujoco", "pybullet", "gazebo")
def test_joint_is_put_and_told(gazebo: Gazebo) -> None:
    gazebo.spawn("arm", ARM)
    told = gazebo.set_model_configuration("arm", "", ["j"], [0.7])
    assert (told.success, told.status_message) == (True, "SetModelConfiguration: success")
    joint = gazebo.get_joint_properties("arm::j")
    assert (joint.success, joint.type, joint.position[0]) == (True, 1, pytest.approx(0.7))
    assert not gazebo.set_model_configuration("arm", "", ["x"], [0.7]).success
    assert not gazebo.set_model_configuration("none", "", [], []).success
    assert not gazebo.get_joint_properties("x").success


@pytest.mark.ros_feature("joint properties and model configuration", "mujoco", "pybullet", "gazebo")
@pytest.mark.ros_feature("joint properties other than the damping", "mujoco", "pybullet", "gazebo", works=False)
def test_joint_damping_is_set_and_other_properties_are_refused(gazebo: Gazebo) -> None:
    from gazebo_msgs.msg import ODEJointProperties

    gazebo.spawn("arm", ARM)
    assert gazebo.set_joint_properties("j", ODEJointProperties(damping=[2.5])).success
    assert gazebo.get_joint_properties("j").damping == (2.5,)
    gazebo.spawn("box", BOX, x=2.0)  # another simulation
    assert gazebo.get_joint_properties("j").damping == (2.5,)
    told = gazebo.set_joint_properties("j", ODEJointProperties(damping=[1.0], fmax=[3.0]))
    assert not told.success
    assert "fmax" in told.status_message
    assert gazebo.get_joint_properties("j").damping == (2.5,)


@pytest.mark.ros_feature("joint efforts and body wrenches", "mujoco", "pybullet", "gazebo")
def test_joint_effort_pushes_for_its_duration(gazebo: Gazebo) -> None:
    import rospy

    gazebo.spawn("arm", ARM.replace("0 0 0.5", "0 0 0"))
    assert gazebo.apply_joint_effort("j", 0.2, rospy.Time(0), rospy.Duration(0.1)).success
    gazebo.step(100)
    rate = gazebo.get_joint_properties("j").rate[0]
    assert rate == pytest.approx(0.2, rel=0.05)  # 0.2 N·m for 0.1 s on 0.1 kg·m²
    gazebo.step(200)
    assert gazebo.get_joint_properties("j").rate[0] == pytest.approx(rate, rel=0.02)
    assert gazebo.apply_joint_effort("j", 0.2, rospy.Time(0), rospy.Duration(-1)).success
    gazebo.step(100)
    gazebo.clear_joint_forces("j")
    faster = gazebo.get_joint_properties("j").rate[0]
    assert faster > 1.5 * rate
    gazebo.step(100)
    assert gazebo.get_joint_properties("j").rate[0] == pytest.approx(faster, rel=0.02)
    assert not gazebo.apply_joint_effort("x", 0.2, rospy.Time(0), rospy.Duration(1)).success


@pytest.mark.ros_feature("joint efforts and body wrenches", "mujoco", "pybullet", "gazebo")
def test_wrench_pushes_for_its_duration(gazebo: Gazebo) -> None:
    import rospy
    from geometry_msgs.msg import Point, Vector3, Wrench

    gazebo.spawn("box", BOX, z=20.0)
    push = Wrench(force=Vector3(x=3.0))
    told = gazebo.apply_body_wrench("box::b", "", Point(), push, rospy.Time(0), rospy.Duration(0.1))
    assert told.success
    gazebo.step(300)
    assert gazebo.get_model_state("box", "").twist.linear.x == pytest.approx(0.3, rel=1e-2)
    gazebo.apply_body_wrench("box::b", "box", Point(y=0.1), push, rospy.Time(0), rospy.Duration(-1))
    gazebo.step(50)
    gazebo.clear_body_wrenches("box::b")
    assert gazebo.get_model_state("box", "").twist.angular.z == pytest.approx(-0.1 * 3.0 * 0.05 / 0.1, rel=0.05)
    assert not gazebo.apply_body_wrench("none::b", "", Point(), push, rospy.Time(0), rospy.Duration(1)).success


@pytest.mark.ros_feature("link states and properties", "mujoco", "pybullet", "gazebo")
@pytest.mark.ros_feature("link states of links that are not a root", "mujoco", "pybullet", "gazebo", works=False)
def test_link_state_is_told_and_set(gazebo: Gazebo) -> None:
    from gazebo_msgs.msg import LinkState

    gazebo.spawn("arm", ARM, z=1.0)
    gazebo.set_model_configuration("arm", "", ["j"], [math.pi / 2])
    told = gazebo.get_link_state("arm::rod", "world")
    assert told.success
    assert told.link_state.pose.orientation.y == pytest.approx(math.sqrt(0.5))
    assert not gazebo.get_link_state("arm::none", "").success
    gazebo.spawn("box", BOX, x=2.0, z=1.0)
    state = LinkState(link_name="box::b", reference_frame="arm")
    state.pose.position.z = 4.0
    assert gazebo.set_link_state(state).success
    assert gazebo.height("box") == pytest.approx(5.0)
    refused = gazebo.set_link_state(LinkState(link_name="arm::rod"))
    assert not refused.success
    assert "set_model_configuration" in refused.status_message


@pytest.mark.ros_feature("link states and properties", "mujoco", "pybullet", "gazebo")
def test_link_mass_is_told_and_set(gazebo: Gazebo) -> None:
    gazebo.spawn("box", BOX, z=1.0)
    told = gazebo.get_link_properties("box::b")
    assert (told.success, told.mass, told.ixx) == (True, pytest.approx(1.0), pytest.approx(0.1))
    inertia = [told.ixx, told.ixy, told.ixz, told.iyy, told.iyz, told.izz]
    assert gazebo.set_link_properties("box::b", told.com, True, 3.0, *inertia).success
    assert gazebo.get_link_properties("box::b").mass == pytest.approx(3.0)
    assert not gazebo.set_link_properties("box::b", told.com, False, 3.0, *inertia).success
    assert not gazebo.get_link_properties("none").success


@pytest.mark.ros_feature("lights", "mujoco", "pybullet", "gazebo")
def test_lights_are_told_set_and_deleted(bridges: Callable[..., Any], gazebo: Gazebo) -> None:
    if not gazebo.get_light_properties("sun").success:
        pytest.skip("not applicable: the sun of this world is gone")
    light = gazebo.get_light_properties("sun")
    light.diffuse.r = 0.25
    from geometry_msgs.msg import Pose, Vector3
    from std_msgs.msg import ColorRGBA

    told = gazebo.set_light_properties("sun", True, light.diffuse, ColorRGBA(), 1.0, 0.5, 0.25, Vector3(), Pose())
    assert told.success
    light = gazebo.get_light_properties("sun")
    assert (light.diffuse.r, light.attenuation_linear) == (0.25, 0.5)
    assert gazebo.delete_light("sun").success
    assert not gazebo.get_light_properties("sun").success
    assert not gazebo.delete_light("sun").success


@pytest.mark.ros_feature("the clock", "mujoco", "pybullet", "gazebo")
@pytest.mark.ros_feature("model states", "mujoco", "pybullet", "gazebo")
@pytest.mark.ros_feature("link states and properties", "mujoco", "pybullet", "gazebo")
def test_topics_tell_the_clock_models_and_links(gazebo: Gazebo) -> None:
    import rospy
    from gazebo_msgs.msg import LinkStates, ModelStates
    from rosgraph_msgs.msg import Clock

    gazebo.spawn("box", BOX, z=1.0)
    heard: dict[str, list[Any]] = {"/clock": [], "/gazebo/model_states": [], "/gazebo/link_states": []}
    kinds = (Clock, ModelStates, LinkStates)
    listeners = [rospy.Subscriber(name, kind, heard[name].append) for name, kind in zip(heard, kinds, strict=True)]
    end = time.monotonic() + 20.0
    while not all(heard.values()) and time.monotonic() < end:
        gazebo.step(100)
        time.sleep(0.05)
    for listener in listeners:
        listener.unregister()
    times = [message.clock.to_sec() for message in heard["/clock"]]
    assert times == sorted(times)
    assert np.diff(times).max(initial=0.0) < 0.021
    assert heard["/gazebo/model_states"][-1].name == ["box"]
    assert heard["/gazebo/link_states"][-1].name == ["box::b"]
    assert heard["/gazebo/link_states"][-1].pose[0].position.z < 1.0


@pytest.mark.ros_feature("the clock", "mujoco", "pybullet", "gazebo")
def test_clock_is_published_once_for_each_time_and_not_read_by_the_bridge_itself(gazebo: Gazebo) -> None:
    import rosgraph
    import rospy
    from rosgraph_msgs.msg import Clock

    heard: list[int] = []
    listener = rospy.Subscriber("/clock", Clock, lambda message: heard.append(message.clock.to_nsec()))
    end = time.monotonic() + 20.0
    while not heard and time.monotonic() < end:
        time.sleep(0.01)  # the last message is latched
    last = round(gazebo.step(1).time * 1e9)
    for _ in range(5):
        gazebo.pause_physics()
    last += 1_000_000
    gazebo.step(1)
    while last not in heard and time.monotonic() < end:
        time.sleep(0.01)
    listener.unregister()
    assert heard == [last - 2_000_000, last - 1_000_000, last]
    _, subscribers, _ = rosgraph.Master("/test").getSystemState()
    assert "/gazebo" not in dict(subscribers).get("/clock", [])

"""Sensors that URDF and SDF files declare: what their topics say is compared with where things are."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat, quat_from_rpy

INERTIA = '<inertial><mass value="2"/><inertia ixx=".02" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial>'
VIEW = (0.5, 0.1, 0.3)  # roll, pitch and yaw of the cameras in their link
EYE = np.array([0.1, 0.2, 1.0])  # where they are in the world
CAMERA = """<sensor type="{kind}" name="{name}"><pose>0.1 0.2 0 0.5 0.1 0.3</pose><update_rate>20</update_rate><camera>
<horizontal_fov>1.2</horizontal_fov><image><width>160</width><height>120</height><format>R8G8B8</format></image>
<clip><near>0.05</near><far>8</far></clip></camera><plugin name="p" filename="lib{plugin}.so"><cameraName>{name}</cameraName>
<frameName>{name}_optical</frameName>{more}</plugin></sensor>"""
MAST = f"""<robot name="mast"><link name="world"/><link name="head">{INERTIA}</link>
<joint name="j" type="fixed"><origin xyz="0 0 1"/><parent link="world"/><child link="head"/></joint>
<gazebo reference="head">{{sensors}}</gazebo></robot>"""
SPHERE = """<sdf version="1.6"><model name="mark"><static>1</static><link name="l"><visual name="v"><geometry><sphere>
<radius>0.05</radius></sphere></geometry><material><diffuse>1 0 0 1</diffuse></material></visual></link></model></sdf>"""
WALL = """<sdf version="1.6"><model name="wall"><static>1</static><link name="l"><visual name="v"><geometry><box>
<size>0.2 3 20</size></box></geometry></visual></link></model></sdf>"""
BOX = f"""<robot name="box"><link name="l">{INERTIA}<collision><geometry><box size=".2 .2 .2"/></geometry></collision></link>
<gazebo reference="l"><sensor type="contact" name="feel"><update_rate>50</update_rate><contact><collision>l_collision</collision>
</contact><plugin name="b" filename="libgazebo_ros_bumper.so"><bumperTopicName>touched</bumperTopicName></plugin></sensor>
<sensor type="imu" name="imu"><pose>0.3 0 0 0 0.4 0</pose><update_rate>100</update_rate>
<plugin name="i" filename="libgazebo_ros_imu_sensor.so"><topicName>imu</topicName><frameName>imu_link</frameName>
<updateRateHZ>40</updateRateHZ></plugin></sensor></gazebo>
<gazebo><plugin name="free" filename="libgazebo_ros_imu.so"><topicName>moved</topicName><bodyName>l</bodyName><updateRate>25</updateRate>
</plugin></gazebo></robot>"""
TURN = matrix_from_quat(quat_from_rpy((0.0, 0.4, 0.0)))  # of the IMU in its link


def proxy(name: str, kind: Any) -> Any:
    import rospy

    return rospy.ServiceProxy(name, kind)


def step(steps: int) -> None:
    from frobs_msgs.srv import StepWorld

    assert proxy("/gazebo/step", StepWorld)(steps).success


class Topics:
    """Subscribes, steps until all have been heard, and keeps what they said."""

    def __init__(self, **kinds: Any) -> None:
        import rospy

        self.heard: dict[str, list[Any]] = {name: [] for name in kinds}
        self._listeners = [
            rospy.Subscriber(f"/{name.replace('__', '/')}", kind, self.heard[name].append)
            for name, kind in kinds.items()
        ]

    def wait(self, count: int = 1, steps: int = 20) -> Topics:
        end = time.monotonic() + 60.0
        while not all(len(messages) >= count for messages in self.heard.values()):
            assert time.monotonic() < end, {name: len(messages) for name, messages in self.heard.items()}
            step(steps)
            time.sleep(0.02)
        return self

    def last(self, name: str) -> Any:
        return self.heard[name][-1]

    def close(self) -> None:
        for listener in self._listeners:
            listener.unregister()


@pytest.fixture
def listen(rosmaster: str) -> Iterator[Callable[..., Topics]]:
    made: list[Topics] = []

    def subscribe(**kinds: Any) -> Topics:
        made.append(Topics(**kinds))
        return made[-1]

    yield subscribe
    for topics in made:
        topics.close()


def spawn(name: str, xml: str, pos: tuple[float, float, float] = (0.0, 0.0, 0.0), namespace: str = "") -> None:
    from gazebo_msgs.srv import SpawnModel
    from geometry_msgs.msg import Point, Pose, Quaternion

    place = Pose(Point(*pos), Quaternion(w=1.0))
    answer = proxy("/gazebo/spawn_urdf_model", SpawnModel)(name, xml, namespace, place, "world")
    assert answer.success, answer.status_message


def rgb(message: Any) -> np.ndarray[Any, Any]:
    return np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, -1).astype(int)


def red_pixel(message: Any) -> Floats:
    """Return the mean column and row of the red pixels."""
    red, green, blue = np.moveaxis(rgb(message), -1, 0)
    rows, columns = np.nonzero((red > 90) & (green < 0.6 * red) & (blue < 0.6 * red))
    assert len(rows), "nothing is red"
    return np.array([columns.mean(), rows.mean()])


def projected(info: Any, point: Floats, eye: Floats, rpy: tuple[float, float, float]) -> Floats:
    """Return the pixel of a point of the world, by a camera_info."""
    ahead, left, up = matrix_from_quat(quat_from_rpy(rpy)).T @ (point - eye)
    x, y, w = np.reshape(info.P, (3, 4)) @ [-left, -up, ahead, 1.0]
    return np.array([x / w, y / w])


def assert_rate(messages: list[Any], rate: float) -> None:
    stamps = [message.header.stamp.to_nsec() for message in messages[1:]]  # a new component publishes at once
    assert len(stamps) >= 4
    np.testing.assert_array_equal(np.diff(stamps), round(1e9 / rate))


def assert_named_once(log: str, sensor: str) -> None:
    assert log.count(f"the sensor '{sensor}' publishes nothing, because the simulator does not support cameras") == 1


@pytest.mark.ros_feature("images of cameras on the bridge over Gazebo 11", works=False)
def test_cameras_show_what_is_there(simulator: str, bridges: Callable[..., Any], listen: Callable[..., Topics]) -> None:
    from sensor_msgs.msg import CameraInfo, Image

    bridge = bridges("--simulator", simulator, "--paused")
    more = "<updateRate>10</updateRate><imageTopicName>seen</imageTopicName><hackBaseline>0.07</hackBaseline>"
    sensors = CAMERA.format(kind="camera", name="eye", plugin="gazebo_ros_camera", more=more)
    sensors += CAMERA.format(kind="camera", name="grey", plugin="gazebo_ros_camera", more="").replace("R8G8B8", "L8")
    sensors += CAMERA.format(kind="depth", name="kinect", plugin="gazebo_ros_openni_kinect", more="")
    spawn("mast", MAST.format(sensors=sensors), namespace="/mast")
    if simulator == "gazebo":
        for name in ("eye", "grey", "kinect"):
            assert_named_once(bridge.log.read_text(), name)
        return
    mark = (2.0, 0.8, 1.3)
    spawn("mark", SPHERE, mark)
    topics = listen(mast__eye__seen=Image, mast__eye__camera_info=CameraInfo, mast__grey__image_raw=Image).wait(6)
    image, info = topics.last("mast__eye__seen"), topics.last("mast__eye__camera_info")
    assert (image.encoding, image.step, image.width, image.height) == ("rgb8", 480, 160, 120)
    assert image.header.frame_id == info.header.frame_id == "eye_optical"
    f = 160 / (2.0 * math.tan(0.6))
    np.testing.assert_allclose(info.K, [f, 0, 80.5, 0, f, 60.5, 0, 0, 1])
    np.testing.assert_allclose(info.P, [f, 0, 80.5, -0.07 * f, 0, f, 60.5, 0, 0, 0, 1, 0])
    info.P = [*info.P[:3], 0.0, *info.P[4:]]  # where a second camera would see it
    expected = projected(info, np.array(mark), EYE, VIEW)
    assert 20 < expected[0] < 140
    assert 20 < expected[1] < 100
    # camera_info of gazebo_ros puts the center one pixel to the right of the drawn one, and one down.
    np.testing.assert_allclose(red_pixel(image), expected - 1.0, atol=0.7)
    assert_rate(topics.heard["mast__eye__seen"], 10)
    assert_rate(topics.heard["mast__eye__camera_info"], 10)
    grey = topics.last("mast__grey__image_raw")
    assert (grey.encoding, grey.step, len(grey.data)) == ("mono8", 160, 160 * 120)
    assert_rate(topics.heard["mast__grey__image_raw"], 20)


@pytest.mark.ros_feature("cameras", "mujoco")
@pytest.mark.slow
def test_depth_is_where_the_wall_is(bridges: Callable[..., Any], listen: Callable[..., Topics]) -> None:
    from sensor_msgs import point_cloud2
    from sensor_msgs.msg import CameraInfo, Image, PointCloud2

    bridges("--paused")
    sensors = CAMERA.format(kind="depth", name="kinect", plugin="gazebo_ros_openni_kinect", more="")
    more = "<pointCloudTopicName>cloud</pointCloudTopicName><pointCloudCutoff>0.1</pointCloudCutoff>"
    far = CAMERA.format(kind="depth", name="far", plugin="gazebo_ros_depth_camera", more=more)
    sensors += far.replace("<far>8</far>", "<far>1e6</far>")  # farther than any simulator draws
    spawn("mast", MAST.format(sensors=sensors))
    spawn("wall", WALL, (3.1, 0.0, 6.0))
    topics = listen(
        kinect__depth__image_raw=Image, kinect__depth__camera_info=CameraInfo, kinect__points=PointCloud2, far__cloud=PointCloud2
    ).wait()  # fmt: skip
    message = topics.last("kinect__depth__image_raw")
    assert (message.encoding, message.header.frame_id) == ("32FC1", "kinect_optical")
    depth = np.frombuffer(message.data, np.float32).reshape(120, 160)
    # Each pixel's ray in the world, of length 1 along the view, meets the wall's face x = 3 or the floor z = 0.
    f = 160 / (2.0 * math.tan(0.6))
    u, v = np.meshgrid((np.arange(160) - 79.5) / f, (np.arange(120) - 59.5) / f)
    rays = np.stack([np.ones_like(u), -u, -v], -1) @ matrix_from_quat(quat_from_rpy(VIEW)).T
    to_wall = (3.0 - EYE[0]) / rays[..., 0]
    at_wall = EYE + to_wall[..., None] * rays
    inside = (np.abs(at_wall[..., 1]) < 1.4) & (at_wall[..., 2] > 0.1) & (to_wall > 0)
    assert inside.sum() > 1000
    np.testing.assert_allclose(depth[inside], to_wall[inside], atol=0.01)
    outside = (np.abs(at_wall[..., 1]) > 1.6) & (rays[..., 2] > -0.05)
    assert outside.sum() > 100
    assert np.isnan(depth[outside]).all()
    cloud = topics.last("kinect__points")
    assert (cloud.height, cloud.width, cloud.is_dense) == (120, 160, False)
    points = np.array(list(point_cloud2.read_points(cloud, ("x", "y", "z")))).reshape(120, 160, 3)
    np.testing.assert_array_equal(np.isnan(points[..., 2]), np.isnan(depth))
    ahead, left, up = points[..., 2], -points[..., 0], -points[..., 1]
    world = EYE + np.stack([ahead, left, up], -1) @ matrix_from_quat(quat_from_rpy(VIEW)).T
    np.testing.assert_allclose(world[inside][:, 0], 3.0, atol=0.01)
    np.testing.assert_allclose(world[inside], at_wall[inside], atol=0.01)
    packed = np.frombuffer(cloud.data, np.uint8).reshape(120, 160, 32)[..., 16:19]
    assert packed[inside].mean() > 20  # the wall is lit
    assert_rate(topics.wait(5).heard["kinect__points"], 20)
    floor = rays[..., 2] < -0.05
    to_floor = np.where(floor, -EYE[2] / np.where(floor, rays[..., 2], 1.0), np.inf)
    nearest = np.minimum(to_floor, np.where(inside, to_wall, np.inf))
    read = np.array(list(point_cloud2.read_points(topics.last("far__cloud"), ("z",)))).reshape(120, 160)
    between = (nearest > 5.2) & (nearest < 15.0) & outside & floor
    np.testing.assert_allclose(read[inside], depth[inside])
    sky = outside & (rays[..., 2] > 0.01)
    assert sky.sum() > 100
    assert np.isnan(read[sky]).all()
    np.testing.assert_allclose(read[between], nearest[between], rtol=0.01)


STANDING = f"""<model name="watcher"><static>1</static><pose>0 0 0.5 0 0 0</pose><link name="pole"><pose>0 0 0.5 0 0 0</pose>
{CAMERA.format(kind="camera", name="eye", plugin="gazebo_ros_camera", more="")}</link></model>"""
HELD = STANDING.replace(
    "<static>1</static>", '<joint name="h" type="fixed"><parent>world</parent><child>pole</child></joint>'
)


@pytest.mark.ros_feature("cameras", "mujoco")
@pytest.mark.parametrize("model", [STANDING, HELD], ids=["static", "held"])
def test_camera_of_a_world_file_sees_and_can_be_moved(
    model: str, bridges: Callable[..., Any], listen: Callable[..., Topics], tmp_path: Path
) -> None:
    from gazebo_msgs.msg import ModelState
    from gazebo_msgs.srv import SetModelState
    from sensor_msgs.msg import CameraInfo, Image

    file = tmp_path / "watched.world"
    file.write_text(f'<sdf version="1.6"><world name="default">{model}</world></sdf>')
    bridges("--world", str(file), "--paused")
    spawn("mark", SPHERE, (2.0, 0.8, 1.3))
    topics = listen(eye__image_raw=Image, eye__camera_info=CameraInfo).wait()
    for moved in (0.0, 0.3):
        state = ModelState(model_name="watcher", reference_frame="world")
        state.pose.position.x, state.pose.position.y, state.pose.position.z, state.pose.orientation.w = 0, moved, 0.5, 1
        assert proxy("/gazebo/set_model_state", SetModelState)(state).success
        count = len(topics.heard["eye__image_raw"])
        topics.wait(count + 3)
        info = topics.last("eye__camera_info")
        expected = projected(info, np.array((2.0, 0.8, 1.3)), EYE + np.array([0.0, moved, 0.0]), VIEW)
        np.testing.assert_allclose(red_pixel(topics.last("eye__image_raw")), expected - 1.0, atol=0.7)


@pytest.mark.ros_feature("contact sensors", "mujoco", "gazebo")
def test_resting_box_feels_its_weight(
    simulator: str, bridges: Callable[..., Any], listen: Callable[..., Topics]
) -> None:
    from gazebo_msgs.msg import ContactsState
    from sensor_msgs.msg import Imu

    bridges("--simulator", simulator, "--paused")
    spawn("below", BOX, (0.0, 0.0, 0.1), "/below")
    spawn("above", BOX, (0.0, 0.0, 0.31), "/above")
    step(1500)
    topics = listen(below__touched=ContactsState, below__imu=Imu, below__moved=Imu, above__touched=ContactsState).wait(
        6
    )
    message = topics.last("below__touched")
    assert message.header.frame_id == "world"
    assert_rate(topics.heard["below__touched"], 50)
    weight = 2.0 * 9.8
    forces = {state.collision2_name: state.total_wrench.force for state in message.states}
    assert {state.collision1_name for state in message.states} == {"below::l::l_collision"}
    assert set(forces) == {"ground_plane::link::collision", "above::l::l_collision"}
    ground, above = (forces[name] for name in ("ground_plane::link::collision", "above::l::l_collision"))
    np.testing.assert_allclose([ground.x, ground.y, ground.z], [0.0, 0.0, 2.0 * weight], atol=0.5)
    np.testing.assert_allclose([above.x, above.y, above.z], [0.0, 0.0, -weight], atol=0.5)
    (only,) = topics.last("above__touched").states
    assert (only.collision1_name, only.collision2_name) == ("above::l::l_collision", "below::l::l_collision")
    assert only.total_wrench.force.z == pytest.approx(weight, abs=0.5)
    imu, moved = topics.last("below__imu"), topics.last("below__moved")
    assert (imu.header.frame_id, moved.header.frame_id) == ("imu_link", "l")
    assert_rate(topics.heard["below__imu"], 40)
    assert_rate(topics.heard["below__moved"], 25)
    np.testing.assert_allclose(_vector(imu.linear_acceleration), TURN.T @ [0.0, 0.0, 9.8], atol=0.1)
    np.testing.assert_allclose(_vector(moved.linear_acceleration), 0.0, atol=0.1)  # gazebo_ros_imu leaves gravity out
    for each in (imu, moved):
        np.testing.assert_allclose(_vector(each.angular_velocity), 0.0, atol=0.03)  # a stack creeps in ODE
    q = imu.orientation
    np.testing.assert_allclose([q.w, q.x, q.y, q.z], quat_from_rpy((0.0, 0.4, 0.0)), atol=1e-3)


@pytest.mark.ros_feature("IMU", "mujoco", "gazebo")
def test_turning_body_reads_its_rate(
    simulator: str, bridges: Callable[..., Any], listen: Callable[..., Topics]
) -> None:
    from gazebo_msgs.msg import ModelState
    from gazebo_msgs.srv import GetLinkState, GetPhysicsProperties, SetModelState, SetPhysicsProperties
    from sensor_msgs.msg import Imu

    bridges("--simulator", simulator, "--paused")
    spawn("box", BOX, (0.0, 0.0, 5.0))
    found = proxy("/gazebo/get_physics_properties", GetPhysicsProperties)()
    found.gravity.z = 0.0
    change = proxy("/gazebo/set_physics_properties", SetPhysicsProperties)
    assert change(found.time_step, found.max_update_rate, found.gravity, found.ode_config).success
    state = ModelState(model_name="box", reference_frame="world")
    state.pose.position.z, state.pose.orientation.w = 5.0, 1.0
    state.twist.angular.z, state.twist.linear.x = 2.0, 0.5
    assert proxy("/gazebo/set_model_state", SetModelState)(state).success
    topics = listen(imu=Imu, moved=Imu).wait(8)
    imu, moved = topics.last("imu"), topics.last("moved")
    np.testing.assert_allclose(_vector(moved.angular_velocity), [0.0, 0.0, 2.0], atol=0.02)
    np.testing.assert_allclose(_vector(moved.linear_acceleration), 0.0, atol=0.05)  # its link does not accelerate
    np.testing.assert_allclose(_vector(imu.angular_velocity), TURN.T @ [0.0, 0.0, 2.0], atol=0.02)
    # 0.3 m off the axis, the sensor is pulled towards it; the chord of 0.05 rad is at the angle halfway.
    pull = 2.0**2 * 0.3 * np.array([-math.cos(0.025), math.sin(0.025), 0.0])
    np.testing.assert_allclose(_vector(imu.linear_acceleration), TURN.T @ pull, atol=0.05)
    link = proxy("/gazebo/get_link_state", GetLinkState)("box::l", "world").link_state
    assert link.twist.angular.z == pytest.approx(2.0, abs=0.02)


def _vector(message: Any) -> list[float]:
    return [message.x, message.y, message.z]


def test_imu_noise_has_the_deviation_that_the_file_says(
    bridges: Callable[..., Any], listen: Callable[..., Topics]
) -> None:
    from sensor_msgs.msg import Imu

    bridges("--paused")
    sensor = """<sensor type="imu" name="i"><update_rate>200</update_rate><plugin name="i" filename="libgazebo_ros_imu_sensor.so">
    <topicName>noisy</topicName><updateRateHZ>200</updateRateHZ><gaussianNoise>0.3</gaussianNoise>
    <rpyOffset>0 0 0.7</rpyOffset></plugin></sensor>"""
    spawn("mast", MAST.format(sensors=sensor))
    messages = listen(noisy=Imu).wait(300, steps=100).heard["noisy"]
    rates = np.array([_vector(message.angular_velocity) for message in messages])
    assert rates.std() == pytest.approx(0.3, rel=0.15)
    assert rates.mean() == pytest.approx(0.0, abs=0.1)
    assert messages[0].linear_acceleration_covariance[4] == pytest.approx(0.09)
    turned = np.mean([message.orientation.z for message in messages])
    assert turned == pytest.approx(math.sin(0.35), abs=0.1)


@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (CAMERA.format(kind="camera", name="e", plugin="gazebo_ros_camera", more="<distortionK1>0.1</distortionK1>"), "distortionK1"),
        (CAMERA.format(kind="camera", name="e", plugin="gazebo_ros_camera", more="").replace("R8G8B8", "BAYER_RGGB8"), "BAYER_RGGB8"),
        (CAMERA.format(kind="camera", name="e", plugin="gazebo_ros_camera", more="").replace(">160<", ">1e30<"), "8192"),
        (CAMERA.format(kind="camera", name="e", plugin="gazebo_ros_camera", more="").replace(">20<", ">nan<"), "update_rate"),
        (CAMERA.format(kind="camera", name="e", plugin="gazebo_ros_camera", more="").replace(">1.2<", ">3.2<"), "horizontal_fov"),
        (CAMERA.format(kind="imu", name="e", plugin="gazebo_ros_camera", more=""), "<camera>"),
        (CAMERA.format(kind="camera", name="e", plugin="gazebo_ros_camera", more="").replace("0.5 0.1 0.3", "0.5"), "6 finite numbers"),
        ('<sensor type="imu" name="i"><plugin name="b" filename="libgazebo_ros_bumper.so"/></sensor>', 'type="contact"'),
        ('<plugin name="i" filename="libgazebo_ros_imu.so"><bodyName>haed</bodyName></plugin>', "haed"),
    ],
    ids=["distortion", "format", "size", "rate", "view", "no camera", "pose", "bumper", "link"],
)  # fmt: skip
def test_sensors_that_cannot_be_made_are_refused(bridges: Callable[..., Any], sensor: str, words: str) -> None:
    from gazebo_msgs.srv import GetWorldProperties, SpawnModel
    from geometry_msgs.msg import Pose

    bridges("--paused")
    answer = proxy("/gazebo/spawn_urdf_model", SpawnModel)("m", MAST.format(sensors=sensor), "", Pose(), "world")
    assert not answer.success
    assert words in answer.status_message
    assert "m" not in proxy("/gazebo/get_world_properties", GetWorldProperties)().model_names


def test_missing_opengl_is_logged_once(
    bridges: Callable[..., Any], listen: Callable[..., Topics], monkeypatch: pytest.MonkeyPatch
) -> None:
    from sensor_msgs.msg import Image

    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent")
    bridge = bridges("--paused", "--robot", "irb120")
    spawn("mast", MAST.format(sensors=CAMERA.format(kind="camera", name="eye", plugin="gazebo_ros_camera", more="")))
    topics = listen(eye__image_raw=Image)
    for _ in range(20):
        step(50)
        time.sleep(0.02)
    assert not topics.heard["eye__image_raw"]
    assert bridge.log.read_text().count("the camera 'eye' publishes nothing") == 1

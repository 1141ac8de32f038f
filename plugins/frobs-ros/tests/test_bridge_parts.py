"""Parts of the bridge that need no ROS: its thread, its splines, what it reads of SDF."""

from __future__ import annotations

import logging
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from frobs_core.models import Cylinder
from frobs_core.plugins import get_record
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.util.errors import ConfigurationError, ModelFileError, SimulationError
from frobs_ros.bridge.controllers.pid import Pid
from frobs_ros.bridge.controllers.spline import Spline
from frobs_ros.bridge.loop import Loop
from frobs_ros.bridge.model import Model
from frobs_ros.bridge.node import OnlyOnce
from frobs_ros.bridge.poses import WORLD, Place
from frobs_ros.bridge.sdf import describe_sdf, read_world
from frobs_ros.bridge.urdf import with_file_uris
from frobs_ros.bridge.world import World


class Counter:
    """Advances by a millisecond each time."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed, self.time, self.failed = speed, 0.0, None
        self.error: Exception | None = None

    def advance(self, most: float) -> None:
        if self.error is not None:
            raise self.error
        self.time += 0.001

    def fail(self, error: Exception) -> None:
        self.failed = error


def test_loop_runs_what_it_is_handed_in_one_thread() -> None:
    loop = Loop(Counter(), paused=True)
    loop.start()
    names = {loop.call(lambda: threading.current_thread().name) for _ in range(3)}
    assert names == {"simulation"}
    with pytest.raises(ZeroDivisionError):
        loop.call(lambda: 1 // 0)
    assert loop.call(lambda: 7) == 7
    loop.close()
    loop.close()
    with pytest.raises(SimulationError, match="shut down"):
        loop.call(lambda: 7)


def test_loop_keeps_pace_with_the_clock_and_stands_still() -> None:
    work = Counter(speed=0.5)
    loop = Loop(work, paused=True)
    loop.start()
    time.sleep(0.1)
    assert work.time == 0.0
    began = time.monotonic()
    loop.call(lambda: loop.set_paused(False))
    time.sleep(0.5)
    loop.call(lambda: loop.set_paused(True))
    assert work.time <= 0.5 * (time.monotonic() - began) + 0.002
    assert work.time > 0.02
    loop.close()


def test_failing_step_pauses_and_services_go_on() -> None:
    work = Counter()
    work.error = RuntimeError("broken")
    loop = Loop(work, paused=False)
    loop.start()
    end = time.monotonic() + 5.0
    while work.failed is None and time.monotonic() < end:
        time.sleep(0.01)
    assert str(work.failed) == "broken"
    assert loop.paused
    assert loop.call(lambda: 7) == 7
    loop.close()


def test_gain_that_is_not_a_number_raises() -> None:
    for name in ("p", "i_clamp", "i_max"):
        with pytest.raises(ConfigurationError, match="not a number"):
            Pid([{"p": 1.0, name: "much"}], "a_joint")


@pytest.mark.parametrize("order", [1, 3, 5], ids=["lines", "cubics", "quintics"])
def test_spline_goes_through_its_points_with_what_they_say(order: int) -> None:
    rng = np.random.default_rng(0)
    times, positions = np.array([0.0, 0.5, 1.2, 2.0]), rng.normal(size=(4, 3))
    velocities = rng.normal(size=(4, 3)) if order >= 3 else None
    accelerations = rng.normal(size=(4, 3)) if order == 5 else None
    spline = Spline(times, positions, velocities, accelerations)
    found = spline.sample(times)
    np.testing.assert_allclose(found[0], positions, atol=1e-12)
    if velocities is not None:
        np.testing.assert_allclose(found[1][:-1], velocities[:-1], atol=1e-12)
        before = spline.sample(times[1:] - 1e-9)
        np.testing.assert_allclose(before[1], velocities[1:], atol=1e-6)
    if accelerations is not None:
        np.testing.assert_allclose(found[2][:-1], accelerations[:-1], atol=1e-12)
    beyond = spline.sample(np.array([-1.0, 9.0]))
    np.testing.assert_allclose(beyond[0], positions[[0, -1]])
    assert not beyond[1].any()


def test_spline_velocity_is_the_rate_of_its_position() -> None:
    rng = np.random.default_rng(1)
    shape = (3, 2)
    spline = Spline(np.array([0.0, 1.0, 2.5]), *(rng.normal(size=shape) for _ in range(3)))
    times, h = np.linspace(0.1, 2.4, 20), 1e-6
    rate = (spline.sample(times + h)[0] - spline.sample(times - h)[0]) / (2 * h)
    np.testing.assert_allclose(spline.sample(times)[1], rate, atol=1e-6)


PENDULUM = """<sdf version="1.6"><model name="pendulum"><pose>0 0 9 0 0 0</pose>
<link name="stand"><pose>0 0 1 0 0 0</pose><collision name="c"><geometry><cylinder><radius>.1</radius><length>.2</length></cylinder></geometry></collision></link>
<link name="rod"><pose>0.5 0 1 0 1.5707963267948966 0</pose><inertial><mass>2</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial></link>
<joint name="hold" type="fixed"><parent>world</parent><child>stand</child></joint>
<joint name="hinge" type="revolute"><pose>0 0 -0.5 0 0 0</pose><parent>stand</parent><child>rod</child>
<axis><xyz>0 1 0</xyz><limit><lower>-1e16</lower><upper>1e16</upper><effort>-1</effort></limit><dynamics><damping>0.3</damping></dynamics></axis></joint>
</model></sdf>"""


def world() -> World:
    record = get_record("simulator", "mujoco")
    assert isinstance(record, SimulatorRecord)
    return World(record)


def test_sdf_links_are_where_the_file_says() -> None:
    made = world()
    description = describe_sdf(PENDULUM)
    assert description.placement is not None
    joint = description.placement.model.actuated_joints[0]
    assert (joint.name, joint.type.value, joint.damping) == ("hinge", "continuous", 0.3)
    made.add(Model("p", "", description, WORLD))
    np.testing.assert_allclose(made.models["p"].link_place("stand").pos, (0.0, 0.0, 1.0), atol=1e-9)
    rod = made.models["p"].link_place("rod")
    np.testing.assert_allclose(rod.pos, (0.5, 0.0, 1.0), atol=1e-9)
    np.testing.assert_allclose(rod.quat_wxyz, (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0), atol=1e-9)
    robot = made.models["p"].robot
    assert robot is not None
    robot.write_joint_state(np.array([[np.pi / 2]]))
    np.testing.assert_allclose(made.models["p"].link_place("rod").pos, (0.0, 0.0, 0.5), atol=1e-6)
    made.close()


def test_static_sdf_is_put_and_holds_what_falls() -> None:
    made = world()
    table = PENDULUM.replace("<model name", "<model name").split('<link name="rod"')[0]
    table = table.replace("</pose>\n", "</pose><static>1</static>\n", 1) + "</model></sdf>"
    description = describe_sdf(table)
    assert isinstance(description.bodies["stand/c"].geometry, Cylinder)
    made.add(Model("table", "", description, WORLD))
    ball = """<sdf version="1.6"><model name="b"><link name="l"><inertial><inertia><ixx>.01</ixx><iyy>.01</iyy><izz>.01</izz></inertia></inertial>
    <collision name="c"><geometry><box><size>.1 .1 .1</size></box></geometry></collision></link></model></sdf>"""
    made.add(Model("ball", "", describe_sdf(ball), Place(np.array([0.0, 0.0, 1.5]), WORLD.quat_wxyz)))
    made.step(1500)
    assert made.models["ball"].place().pos[2] == pytest.approx(1.15, abs=0.01)
    made.put(made.models["table"], Place(np.array([5.0, 0.0, 0.0]), WORLD.quat_wxyz))
    made.step(1500)
    assert made.models["ball"].place().pos[2] == pytest.approx(0.05, abs=0.01)
    assert made.models["table"].place().pos[0] == 5.0
    made.close()


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ('<link name="l"><projector/></link>', "<projector>"),
        ('<link name="l"/><model name="inner"/>', "<model>"),
        ('<link name="l"><sensor name="s" type="sonar"/></link>', "sonar"),
        (
            '<link name="l"/><link name="m"/><joint name="j" type="ball"><parent>l</parent><child>m</child></joint>',
            "ball",
        ),
        ('<link name="l"><pose relative_to="x">0 0 0 0 0 0</pose></link>', "relative_to"),
        ('<link name="l"/><link name="m"/>', "no parent"),
        ('<link name="l"><collision name="c"><geometry><polyline/></geometry></collision></link>', "<polyline>"),
        (
            '<link name="l"><collision name="c"><geometry><box><size>1 1</size></box></geometry></collision></link>',
            "3 finite",
        ),
        ("", "no <link>"),
    ],
    ids=["projector", "nested", "sonar", "ball", "relative", "loose", "polyline", "size", "empty"],
)
@pytest.mark.ros_feature("SDF elements that the bridge does not read", "mujoco", works=False)
def test_what_is_outside_of_the_part_of_sdf_is_refused_by_name(inside: str, words: str) -> None:
    with pytest.raises(ModelFileError, match=words):
        describe_sdf(f'<sdf version="1.6"><model name="m">{inside}</model></sdf>')


def test_that_the_master_is_gone_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    logger = logging.getLogger("test.rosout")
    logger.addFilter(OnlyOnce())
    for _ in range(3):
        logger.warning("unable to communicate with ROS Master, registrations are now out of sync")
        logger.warning("something else")
    assert caplog.text.count("out of sync") == 1
    assert caplog.text.count("something else") == 3


def test_gravity_of_a_whole_model_is_ignored_with_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    inside = '<pose>1 2 3 0 0 0</pose><gravity>0</gravity><link name="l"/>'
    description = describe_sdf(f'<sdf version="1.6"><model name="m">{inside}</model></sdf>')
    assert description.placement is not None
    assert description.pose.pos == (1.0, 2.0, 3.0)
    assert "supports it only in a <link>" in caplog.text


def test_world_file_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    crate = tmp_path / "models" / "crate"
    crate.mkdir(parents=True)
    (crate / "model.config").write_text('<model><name>crate</name><sdf version="1.6">crate.sdf</sdf></model>')
    (crate / "crate.sdf").write_text(
        '<sdf version="1.6"><model name="crate"><link name="l"><collision name="c"><geometry><box><size>1 1 1</size>'
        "</box></geometry></collision></link></model></sdf>"
    )
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(tmp_path / "models"))
    file = tmp_path / "my.world"
    file.write_text(
        '<sdf version="1.6"><world name="w"><include><uri>model://ground_plane</uri></include>'
        "<include><uri>model://sun</uri></include><gravity>0 0 -3.7</gravity>"
        "<physics type='ode'><max_step_size>0.002</max_step_size><real_time_update_rate>0</real_time_update_rate></physics>"
        "<include><uri>model://crate</uri><name>mine</name><pose>1 2 3 0 0 0</pose><static>true</static></include>"
        "</world></sdf>"
    )
    read = read_world(file)
    assert (read.floor, read.gravity, read.timestep, read.max_update_rate) == (True, (0.0, 0.0, -3.7), 0.002, 0.0)
    description, place = read.models["mine"]
    assert description.placement is None
    assert place.pos.tolist() == [1.0, 2.0, 3.0]
    assert read.lights == ["sun"]
    file.write_text(file.read_text().replace("<gravity>", "<road name='r'/><gravity>"))
    with pytest.raises(ModelFileError, match=r"my\.world:1: <road name=\"r\">"):
        read_world(file)


def test_meshes_of_a_description_are_uris_that_rviz_opens() -> None:
    link = '<link name="l"><visual><geometry><mesh filename="{}"/></geometry></visual></link>'
    for name, uri in (("/a/b.stl", "file:///a/b.stl"), ("package://a/b.stl", "package://a/b.stl")):
        assert f'filename="{uri}"' in with_file_uris(f'<robot name="r">{link.format(name)}</robot>')

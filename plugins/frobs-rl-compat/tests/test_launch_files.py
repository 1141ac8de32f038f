"""Launch files that include gazebo_ros run unmodified, with the replacements of ROS packages that are not installed."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
TINY_ARM = HERE / "packages" / "tiny_arm"
ORIGINALS = HERE.parents[3] / "shared" / "frobs_rl" / "originals" / "frobs_rl_resources"

LAUNCH = """<launch>
  <arg name="gui" default="false"/>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="paused" value="true"/>
    <arg name="use_sim_time" value="true"/>
    <arg name="gui" value="$(arg gui)"/>
    <arg name="headless" value="false"/>
    <arg name="debug" value="false"/>
  </include>
  <group ns="arm">
    <param name="robot_description" command="$(find xacro)/xacro '$(find tiny_arm)/urdf/arm.urdf.xacro' length:=0.4"/>
    <rosparam file="$(find tiny_arm)/config/controllers.yaml" command="load"/>
    <node name="spawn_arm" pkg="gazebo_ros" type="spawn_model" respawn="false" output="screen"
          args="-urdf -param robot_description -model arm -x 1.0 -y -0.5 -Y 0.5 -J joint_two 0.4 -unpause"/>
    <node name="spawner" pkg="controller_manager" type="spawner" args="joint_state_controller"/>
  </group>
</launch>
"""

DRIVER = """
import json, math, signal, subprocess, sys, time
import rosgraph
import rospy

launch = subprocess.Popen(["roslaunch", {package!r}, {file!r}, *{arguments!r}])
try:
    limit = time.monotonic() + 120
    def wait(ready):
        while True:
            try:
                if ready():
                    return
            except Exception:
                pass
            assert time.monotonic() < limit and launch.poll() is None, "it does not get ready"
            time.sleep(0.1)
    wait(rosgraph.is_master_online)
    rospy.init_node("driver", disable_signals=True)
    from controller_manager_msgs.srv import ListControllers
    from gazebo_msgs.srv import GetModelState, GetPhysicsProperties, GetWorldProperties
    from sensor_msgs.msg import JointState
    ask = lambda name, kind, *fields: rospy.ServiceProxy(name, kind)(*fields)
    wait(lambda: {model!r} in ask("/gazebo/get_world_properties", GetWorldProperties).model_names)
    ns = {namespace!r}
    controllers = lambda: {{c.name: c.state for c in ask(ns + "/controller_manager/list_controllers", ListControllers).controller}}
    wait(lambda: all(controllers().get(name) == "running" for name in {running!r}))
    wait(lambda: not ask("/gazebo/get_physics_properties", GetPhysicsProperties).pause)
    pose = ask("/gazebo/get_model_state", GetModelState, {model!r}, "world").pose
    states = rospy.wait_for_message(ns + "/joint_states", JointState, 20) if {running!r} else None
    print("RESULT", json.dumps({{
        "pos": [pose.position.x, pose.position.y, pose.position.z],
        "yaw": 2.0 * math.atan2(pose.orientation.z, pose.orientation.w),
        "joints": dict(zip(states.name, states.position)) if states else {{}},
        "controllers": controllers() if {running!r} else {{}},
        "sim_time": rospy.get_param("/use_sim_time"),
    }}), flush=True)
finally:
    launch.send_signal(signal.SIGINT)
    assert launch.wait(60) is not None
"""


def run_launch(run: Callable[..., str], folder: Path, package: str, file: str, *arguments: str, **expected: Any) -> Any:
    """Launch a file and return what is in the simulation then."""
    script = folder / "driver.py"
    values = {"model": "arm", "namespace": "", "running": [], **expected}
    script.write_text(DRIVER.format(package=package, file=file, arguments=arguments, **values))
    return json.loads(re.search(r"^RESULT (.*)$", run(script), re.MULTILINE)[1])


@pytest.mark.slow
@pytest.mark.ros_feature("launch files with gazebo_ros and spawn_model", "replacement", "mujoco", "gazebo")
def test_a_robot_is_spawned_by_a_launch_file_that_includes_gazebo_ros(backend, run_in_workspace, tmp_path):
    shutil.copytree(TINY_ARM, tmp_path / "src" / "tiny_arm")
    (tmp_path / "src" / "tiny_arm" / "launch" / "world.launch").write_text(LAUNCH)
    found = run_launch(
        run_in_workspace(tmp_path / "src", backend),
        tmp_path,
        "tiny_arm",
        "world.launch",
        namespace="/arm",
        running=["joint_state_controller"],
    )
    assert found["pos"] == pytest.approx([1.0, -0.5, 0.0], abs=1e-3)
    assert found["yaw"] == pytest.approx(0.5, abs=1e-3)
    assert found["joints"]["joint_two"] == pytest.approx(0.4, abs=0.05)
    assert found["sim_time"] is True


@pytest.mark.slow
@pytest.mark.needs("originals")
@pytest.mark.parametrize(
    ("package", "file", "arguments", "expected"),
    [
        ("abb_irb140", "irb140_gazebo.launch", [], {"model": "robot1", "running": ["joint_state_controller"]}),
        # The file that it names by default is not part of the package.
        ("kobuki_maze_rl", "visualize_gazebo.launch", ["maze_world:=worlds/empty.world"], {"model": "mobile_base"}),
    ],
)
@pytest.mark.ros_feature("launch files with gazebo_ros and spawn_model", "replacement", "mujoco")
def test_launch_files_of_original_packages_run_unmodified(
    run_in_workspace, tmp_path, package, file, arguments, expected
):
    shutil.copytree(ORIGINALS, tmp_path / "src")
    run = run_in_workspace(tmp_path / "src", "bridge:mujoco")
    found = run_launch(run, tmp_path, package, file, *arguments, **expected)
    assert found["pos"] == pytest.approx([0.0, 0.0, 0.0], abs=0.05)

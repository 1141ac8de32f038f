"""Starts the bridge with an IRB 120 that has a finger, and move_group: what all scripts of these tests need."""

import json

import rospy
from frobs_rl.common import ros_controllers, ros_gazebo, ros_launch

from frobs_core.models import load_model

JOINTS = [f"joint_{i}" for i in range(1, 7)]
FINGER = """
<link name="world"/><joint name="fixed" type="fixed"><parent link="world"/><child link="base_link"/></joint>
<link name="finger"><inertial><mass value="0.05"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.04"/><geometry><box size="0.01 0.02 0.04"/></geometry></collision></link>
<joint name="finger_joint" type="prismatic"><parent link="tool0"/><child link="finger"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.04" effort="50" velocity="0.2"/></joint>
<gazebo><plugin name="control" filename="libgazebo_ros_control.so"/></gazebo>
"""
DRIVE = (
    '<transmission name="{0}_drive"><type>transmission_interface/SimpleTransmission</type><joint name="{0}">'
    "<hardwareInterface>hardware_interface/PositionJointInterface</hardwareInterface></joint></transmission>"
)


def urdf():
    arm = load_model("frobs_robots_abb:models/irb120.urdf.xacro").xml
    drives = "".join(DRIVE.format(joint) for joint in (*JOINTS, "finger_joint"))
    return arm.replace("</robot>", FINGER + drives + "</robot>")


def start():
    ros_gazebo.launch_Gazebo(paused=True, gui=False)
    rospy.init_node("client")
    rospy.set_param("/robot_description", urdf())
    for name, joints in (("arm", JOINTS), ("gripper", ["finger_joint"])):
        kind = "position_controllers/JointTrajectoryController"
        rospy.set_param(f"/{name}", {"type": kind, "joints": joints, "constraints": {"goal_time": 1.0}})
    rospy.set_param("/joint_state_controller/type", "joint_state_controller/JointStateController")
    ros_gazebo.gazebo_set_max_update_rate(10)
    assert ros_gazebo.gazebo_spawn_urdf_param(
        "/robot_description", model_name="arm", robot_namespace="/", pos_z=0.0, ori_w=1.0
    )
    assert ros_controllers.spawn_controllers_srv(["joint_state_controller", "arm", "gripper"], ns="/")
    ros_launch.ros_launch_from_pkg("arm_moveit", "move_group.launch", launch_new_term=False)
    rospy.wait_for_service("/move_group/trajectory_execution/set_parameters")
    ros_gazebo.gazebo_unpause_physics()


def tell(**results):
    print("RESULT", json.dumps(results), flush=True)

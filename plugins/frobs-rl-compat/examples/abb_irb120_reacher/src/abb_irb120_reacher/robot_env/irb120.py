#!/bin/python3

import numpy as np
import rospy
from frobs_rl.common import ros_gazebo
from frobs_rl.envs import robot_BasicEnv
from gymnasium import spaces
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


class ABBIRB120Env(robot_BasicEnv.RobotBasicEnv):
    """
    Superclass for all ABB IRB120 environments.

    Sensor Topic List:
    * joint_states : JointState received for the joints of the robot

    Actuators Topic List:
    * arm120_controller/command : JointTrajectory of one point, which the controller reaches by the end of the step
    """

    def __init__(self):
        rospy.loginfo("Starting ABBIRB120 Env")

        self.model_name_in_gazebo = "irb120"
        self.namespace = "/irb120"
        pkg_name = "abb_irb120_reacher"
        urdf_file = "irb120.urdf.xacro"
        urdf_xacro_args = ["robot_namespace:=/irb120"]
        controller_file = "irb120_pos_controller.yaml"
        self.controller_list = ["joint_state_controller", "arm120_controller"]

        """
        0.1 s of simulated time for each action, always.
        """
        gazebo_timestep = 0.002
        gazebo_max_freq = 20
        step_mode = 2
        num_gazebo_steps = 50
        self.step_duration = 0.1

        super(ABBIRB120Env, self).__init__(
            launch_gazebo=False,
            gazebo_max_freq=gazebo_max_freq,
            gazebo_timestep=gazebo_timestep,
            spawn_robot=True,
            model_name_in_gazebo=self.model_name_in_gazebo,
            namespace=self.namespace,
            pkg_name=pkg_name,
            urdf_file=urdf_file,
            urdf_xacro_args=urdf_xacro_args,
            controller_file=controller_file,
            controller_list=self.controller_list,
            model_ori_w=1.0,
            reset_controllers=False,
            reset_mode=1,
            step_mode=step_mode,
            num_gazebo_steps=num_gazebo_steps,
        )

        self.joint_names = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"]
        self.joint_space = spaces.Box(low=-7.0, high=7.0, shape=(6,))
        self.joint_state = JointState()
        self.joint_state_sub = rospy.Subscriber(self.namespace + "/joint_states", JointState, self.joint_state_callback)
        self.trajectory_pub = rospy.Publisher(
            self.namespace + "/arm120_controller/command", JointTrajectory, queue_size=1
        )

        ros_gazebo.gazebo_unpause_physics()
        self._check_subs_and_pubs_connection()
        ros_gazebo.gazebo_pause_physics()
        rospy.loginfo("Finished Init of ABBIRB120 Env")

    def joint_state_callback(self, joint_state):
        self.joint_state = joint_state

    def _check_subs_and_pubs_connection(self):
        """
        Function to check if the gazebo and ros connections are ready
        """
        rospy.wait_for_message(self.namespace + "/joint_states", JointState, timeout=10.0)
        while self.trajectory_pub.get_num_connections() == 0 and not rospy.is_shutdown():
            rospy.sleep(0.02)
        return True

    def get_joint_angles(self):
        """
        The angles of the last joint state, in the order of joint_names
        """
        position = dict(zip(self.joint_state.name, self.joint_state.position))
        return np.array([position[name] for name in self.joint_names])

    def set_trajectory_joints(self, angles, duration):
        """
        Function to move to the angles within the duration [s]
        """
        point = JointTrajectoryPoint(positions=list(angles), time_from_start=rospy.Duration.from_sec(duration))
        self.trajectory_pub.publish(JointTrajectory(joint_names=self.joint_names, points=[point]))

    def get_ee_pos(self, angles):
        """
        The place of the last link's flange, by forward kinematics
        """
        offsets = ([0, 0, 0], [0, 0, 0.29], [0, 0, 0.27], [0, 0, 0.07], [0.302, 0, 0], [0.072, 0, 0])
        position, rotation = np.zeros(3), np.eye(3)
        for offset, axis, angle in zip(offsets, "zyyxyx", angles):
            position = position + rotation @ np.array(offset)
            c, s = np.cos(angle), np.sin(angle)
            turn = {
                "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
                "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
                "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
            }
            rotation = rotation @ np.array(turn[axis])
        return position

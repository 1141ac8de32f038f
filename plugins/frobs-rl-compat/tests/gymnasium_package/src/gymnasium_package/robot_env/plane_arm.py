#!/bin/python3

import rospy
from frobs_rl.common import ros_gazebo, ros_launch
from frobs_rl.envs import robot_BasicEnv
from gymnasium import spaces
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray


class PlaneArmEnv(robot_BasicEnv.RobotBasicEnv):
    """
    Superclass for all environments with the plane arm.
    """

    def __init__(self):
        rospy.loginfo("Starting Plane Arm Env")

        """
        If launching Gazebo with the env then set the corresponding environment variables.
        """
        launch_gazebo = False
        gazebo_max_freq = 10.0
        gazebo_timestep = 0.002

        """
        If spawning the robot using the given spawner then set the corresponding environment variables.
        """
        spawn_robot = True
        model_name_in_gazebo = "plane_arm"
        namespace = "/plane_arm"
        pkg_name = "gymnasium_package"
        urdf_file = "plane_arm.urdf.xacro"
        urdf_folder = "/urdf"
        controller_file = "arm_controllers.yaml"
        controller_list = ["joint_state_controller", "arm_controller"]
        urdf_xacro_args = ["use_pos_ctrls:=true", "robot_namespace:=/plane_arm"]
        rob_state_publisher_max_freq = 50
        model_pos_x = 0.0
        model_pos_y = 0.0
        model_pos_z = 0.0
        model_ori_w = 1.0

        reset_controllers = False
        reset_mode = 2
        step_mode = 2
        num_gazebo_steps = 20

        super(PlaneArmEnv, self).__init__(
            launch_gazebo=launch_gazebo,
            gazebo_max_freq=gazebo_max_freq,
            gazebo_timestep=gazebo_timestep,
            spawn_robot=spawn_robot,
            model_name_in_gazebo=model_name_in_gazebo,
            namespace=namespace,
            pkg_name=pkg_name,
            urdf_file=urdf_file,
            urdf_folder=urdf_folder,
            controller_file=controller_file,
            controller_list=controller_list,
            urdf_xacro_args=urdf_xacro_args,
            rob_state_publisher_max_freq=rob_state_publisher_max_freq,
            model_pos_x=model_pos_x,
            model_pos_y=model_pos_y,
            model_pos_z=model_pos_z,
            model_ori_w=model_ori_w,
            reset_controllers=reset_controllers,
            reset_mode=reset_mode,
            step_mode=step_mode,
            num_gazebo_steps=num_gazebo_steps,
        )

        """
        Define publisher or subscribers as needed.
        """
        self.joint_names = ["shoulder", "elbow"]
        self.joint_state = JointState()
        self.joint_sub = rospy.Subscriber("/plane_arm/joint_states", JointState, self.joint_state_callback)
        self.joint_pub = rospy.Publisher("/plane_arm/arm_controller/command", Float64MultiArray, queue_size=1)
        self.raw_space = spaces.Box(low=-3.2, high=3.2, shape=(2,))
        ros_launch.ros_launch_from_pkg(
            "gymnasium_package", "goal.launch", args=["namespace:=/plane_arm"], launch_new_term=False
        )

        ros_gazebo.gazebo_unpause_physics()
        self._check_subs_and_pubs_connection()
        ros_gazebo.gazebo_pause_physics()

        rospy.loginfo("Finished Init of Plane Arm Env")

    def joint_state_callback(self, message):
        self.joint_state = message

    def _check_subs_and_pubs_connection(self):
        """
        Function to check if the Gazebo and ROS connections are ready
        """
        rospy.wait_for_message("/plane_arm/joint_states", JointState, timeout=10.0)
        rate = rospy.Rate(50)
        while self.joint_pub.get_num_connections() == 0 and not rospy.is_shutdown():
            rate.sleep()
        return True

    def get_joint_angles(self):
        position = dict(zip(self.joint_state.name, self.joint_state.position))
        return [position[name] for name in self.joint_names]

    def set_joint_angles(self, angles):
        self.joint_pub.publish(Float64MultiArray(data=list(angles)))

#!/bin/python3

import numpy as np
import rospy
from frobs_rl.common import ros_gazebo
from frobs_rl.envs import robot_BasicEnv
from geometry_msgs.msg import Twist
from gym import spaces
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

MAX_RANGE = 30.0


class KobukiLIDAREnv(robot_BasicEnv.RobotBasicEnv):
    """
    Superclass for all Kobuki environments with a lidar.
    """

    def __init__(self):
        rospy.loginfo("Starting Kobuki LIDAR Env")

        spawn_robot = True
        self.model_name_in_gazebo = "kobuki_robot"
        namespace = "/"
        pkg_name = "kobuki_maze_rl"
        urdf_file = "kobuki_lidar.urdf.xacro"
        urdf_folder = "/urdf"
        rob_state_publisher_max_freq = 30
        model_pos_x = -5.0
        model_pos_y = 7.5
        model_pos_z = 0.01
        model_ori_w = 1.0

        """
        0.1 s of simulated time for each action: FRobs_RL's own maze left it to the clock on the wall.
        """
        gazebo_timestep = 0.01
        gazebo_max_freq = 20
        reset_mode = 2
        step_mode = 2
        num_gazebo_steps = 10

        super(KobukiLIDAREnv, self).__init__(
            gazebo_timestep=gazebo_timestep,
            gazebo_max_freq=gazebo_max_freq,
            spawn_robot=spawn_robot,
            model_name_in_gazebo=self.model_name_in_gazebo,
            namespace=namespace,
            pkg_name=pkg_name,
            urdf_file=urdf_file,
            urdf_folder=urdf_folder,
            controller_list=[],
            rob_state_publisher_max_freq=rob_state_publisher_max_freq,
            model_pos_x=model_pos_x,
            model_pos_y=model_pos_y,
            model_pos_z=model_pos_z,
            model_ori_w=model_ori_w,
            reset_mode=reset_mode,
            step_mode=step_mode,
            num_gazebo_steps=num_gazebo_steps,
        )

        self.raw_scan_space = spaces.Box(low=0.0, high=MAX_RANGE, shape=(8,))
        self.scan, self.odom = None, None
        self.scan_sub = rospy.Subscriber("/scan", LaserScan, self.scan_callback)
        self.odom_sub = rospy.Subscriber("/odom", Odometry, self.odom_callback)
        self.vel_pub = rospy.Publisher("/cmd_vel", Twist, queue_size=1)

        ros_gazebo.gazebo_unpause_physics()
        self._check_subs_and_pubs_connection()
        ros_gazebo.gazebo_pause_physics()
        rospy.loginfo("Finished Init of Kobuki LIDAR Env")

    def scan_callback(self, scan):
        ranges = np.nan_to_num(np.array(scan.ranges), nan=MAX_RANGE, posinf=MAX_RANGE)
        self.scan = np.clip(ranges, 0.0, MAX_RANGE)

    def odom_callback(self, odom):
        pose = odom.pose.pose
        q = pose.orientation
        yaw = np.arctan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        self.odom = np.array([pose.position.x, pose.position.y, yaw])

    def _check_subs_and_pubs_connection(self):
        """
        Function to check if the Gazebo and ROS connections are ready
        """
        for _ in range(3):
            rospy.wait_for_message("/scan", LaserScan, timeout=10.0)
        rospy.wait_for_message("/odom", Odometry, timeout=10.0)
        while self.vel_pub.get_num_connections() == 0 and not rospy.is_shutdown():
            rospy.sleep(0.02)
        return True

    def drive(self, linear, angular):
        message = Twist()
        message.linear.x, message.angular.z = float(linear), float(angular)
        self.vel_pub.publish(message)

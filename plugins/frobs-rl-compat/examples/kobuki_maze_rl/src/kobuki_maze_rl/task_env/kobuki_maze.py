#!/bin/python3

import time

import numpy as np
import rospy
from frobs_rl.common import ros_gazebo, ros_launch
from geometry_msgs.msg import Point, PointStamped
from gym import spaces
from gym.envs.registration import register

from kobuki_maze_rl.robot_env import kobuki_lidar

register(
    id="KobukiMazeEnv-v0",
    entry_point="kobuki_maze_rl.task_env.kobuki_maze:KobukiMazeEnv",
    max_episode_steps=1000000000000,
)

ROUTES = (
    ((-8.5, 0), (-8.5, -2), (-1, -7), (-1, -11.5), (3, -11.5), (3, -6), (3, 0)),
    ((-8.5, 0), (-8.5, -2), (-1, -7), (-1, -11.5), (-6, -9.5), (-8.5, -9.5), (-8.5, -11.5)),
    ((-8.5, 0), (-8.5, -2), (-8.7, -3), (-8.7, -4), (-8.7, -5), (-8.7, -6), (-8.7, -7)),
    ((-8.5, 0), (-8.5, -2), (0, -4), (0, -3.5), (0, -3), (0, -2.5), (0, -2)),
)

# where the two boxes begin, m
BOXES = {"box_1": (-2.5, -5.0), "box_2": (-6.5, -5.0)}


class KobukiMazeEnv(kobuki_lidar.KobukiLIDAREnv):
    """
    The robot follows one of four routes through the maze, waypoint by waypoint; two boxes go to and fro.
    """

    def __init__(self):
        rospy.loginfo("Starting Kobuki Maze Task Env")

        """
        Load YAML param file
        """
        ros_launch.ros_launch_from_pkg("kobuki_maze_rl", "maze.launch", launch_new_term=False)
        self.get_params()

        """
        Define the action and observation space.
        """
        # linear m/s, angular rad/s
        self.action_space = spaces.Box(low=-1.0, high=1.0, shape=(2,), dtype=np.float32)
        # distance and bearing of the waypoint, x, y, yaw, waypoint, lidar
        place_low, place_high = np.array([-10.5, -13.5]), np.array([5.5, 13.5])
        low = np.concatenate([[0.0, -np.pi], place_low, [-np.pi], place_low, np.zeros(self.lidar_samples)])
        high = np.concatenate([[75.0, np.pi], place_high, [np.pi], place_high, 30.0 * np.ones(self.lidar_samples)])
        self.observation_space = spaces.Box(low=low, high=high, dtype=np.float64)

        self.marker_pub = rospy.Publisher("goal_marker", PointStamped, queue_size=1)
        self.route, self.index = ROUTES[0], 0

        """
        Init super class.
        """
        super(KobukiMazeEnv, self).__init__()

        """
        Spawn the boxes.
        """
        for name, (x, y) in BOXES.items():
            spawned, message = ros_gazebo.gazebo_spawn_sdf_pkg(
                "kobuki_maze_rl", "box.sdf", model_name=name, pos_x=x, pos_y=y
            )
            if not spawned:
                rospy.logerr(name + ": " + message)
        rospy.loginfo("Finished Init of Kobuki Maze Task env")

    def _set_episode_init_params(self):
        """
        The robot at the start, turned at random, and a route.
        """
        yaw = self.np_random.uniform(-np.pi, np.pi)
        self.drive(0.0, 0.0)
        ros_gazebo.gazebo_set_model_state(
            self.model_name_in_gazebo, pos_x=-5.0, pos_y=7.5, pos_z=0.01, ori_z=np.sin(yaw / 2), ori_w=np.cos(yaw / 2)
        )
        self.route, self.index = ROUTES[int(self.np_random.integers(len(ROUTES)))], 0

        # each box turned at random, and how far it goes in a step, m
        self.steps, self.way = 0, 0
        self.box_yaw = self.np_random.uniform(-np.pi, np.pi, len(BOXES))
        self.box_step = self.np_random.uniform(0.0, self.max_box_step, len(BOXES))
        self.move_boxes()
        self._check_subs_and_pubs_connection()

    def _send_action(self, action):
        """
        Linear and angular velocity; the boxes turn back after 100 steps, then after every 200
        """
        self.way += 1 if (self.steps // 100 + 1) // 2 % 2 == 0 else -1
        self.steps += 1
        self.move_boxes()
        self.drive(action[0], action[1])

    def move_boxes(self):
        """
        Put each box as far along its own x axis as it has gone
        """
        for (name, (x, y)), yaw, step in zip(BOXES.items(), self.box_yaw, self.box_step):
            ros_gazebo.gazebo_set_model_state(
                name,
                pos_x=x + self.way * step * np.cos(yaw),
                pos_y=y + self.way * step * np.sin(yaw),
                ori_z=np.sin(yaw / 2),
                ori_w=np.cos(yaw / 2),
                sleep_time=0.0,
            )

    def _get_observation(self):
        """
        The waypoint from the robot, the robot, the waypoint, the lidar
        """
        waypoint = np.array(self.route[self.index], dtype=float)
        way = waypoint - self.odom[:2]
        self.distance = np.linalg.norm(way)
        bearing = np.arctan2(way[1], way[0]) - self.odom[2]
        self.bearing = (bearing + np.pi) % (2 * np.pi) - np.pi
        marker = PointStamped(point=Point(waypoint[0], waypoint[1], 0.0))
        marker.header.frame_id = "odom"
        self.marker_pub.publish(marker)
        return np.concatenate([[self.distance, self.bearing], self.odom, waypoint, self.scan])

    def _get_reward(self):
        """
        More at a waypoint, less the farther it is, and much less near a wall
        """
        if self.distance <= self.tolerance_goal_pos:
            last = self.index == len(self.route) - 1
            reward = self.reached_goal_reward if last else self.reached_midway_reward
        else:
            angle = min(abs(self.bearing), np.pi - abs(self.bearing))
            reward = -self.mult_dist_reward * self.distance - self.angle_diff_reward_multiplier * angle
            reward += self.not_reached_midway_reward * (len(self.route) - self.index)
        if self.scan.min() < self.collision_distance_threshold:
            reward += self.collision_reward
        return float(reward)

    def _check_if_done(self):
        """
        Done at the last waypoint; at another it is the next one's turn
        """
        if self.distance > self.tolerance_goal_pos:
            return False
        if self.index < len(self.route) - 1:
            self.index += 1
            return False
        self.info["is_success"] = 1.0
        return True

    def get_params(self):
        """
        Get configuration parameters
        """
        while not rospy.has_param("/kobuki_maze_task") and not rospy.is_shutdown():  # the launch file loads them
            time.sleep(0.1)
        self.lidar_samples = rospy.get_param("/kobuki_maze_task/lidar_samples")
        self.tolerance_goal_pos = rospy.get_param("/kobuki_maze_task/tolerance_goal_pos")
        self.mult_dist_reward = rospy.get_param("/kobuki_maze_task/multiplier_dist_reward")
        self.angle_diff_reward_multiplier = rospy.get_param("/kobuki_maze_task/angle_diff_reward_multiplier")
        self.reached_midway_reward = rospy.get_param("/kobuki_maze_task/reached_midway_reward")
        self.not_reached_midway_reward = rospy.get_param("/kobuki_maze_task/not_reached_midway_reward")
        self.reached_goal_reward = rospy.get_param("/kobuki_maze_task/reached_goal_reward")
        self.collision_reward = rospy.get_param("/kobuki_maze_task/collision_reward")
        self.collision_distance_threshold = rospy.get_param("/kobuki_maze_task/collision_distance_threshold")
        self.max_box_step = rospy.get_param("/kobuki_maze_task/max_box_step")

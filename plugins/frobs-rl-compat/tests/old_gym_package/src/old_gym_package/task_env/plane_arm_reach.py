#!/bin/python3

import numpy as np
import rospy
from frobs_rl.common import ros_params
from geometry_msgs.msg import Point
from gym import spaces
from gym.envs.registration import register

from old_gym_package.robot_env import plane_arm

register(
    id="PlaneArmReachEnv-v0",
    entry_point="old_gym_package.task_env.plane_arm_reach:PlaneArmReachEnv",
    max_episode_steps=10000,
)

LINK_LENGTH = 0.3


class PlaneArmReachEnv(plane_arm.PlaneArmEnv):
    """
    The arm brings its tool to a goal in the plane.
    """

    def __init__(self):
        rospy.loginfo("Starting Task Env")

        """
        Load YAML param file
        """
        ros_params.ros_load_yaml_from_pkg("old_gym_package", "reach_task.yaml", ns="/")
        self.get_params()

        """
        Define the action and observation space.
        """
        self.action_space = spaces.Box(low=-self.max_joint_step, high=self.max_joint_step, shape=(2,), dtype=np.float32)

        goal_low = np.array([self.position_goal_min["x"], self.position_goal_min["y"]])
        goal_high = np.array([self.position_goal_max["x"], self.position_goal_max["y"]])
        reach = 2 * LINK_LENGTH + 0.1
        high = np.concatenate([self.max_joint_values, goal_high, np.array([reach, reach])])
        low = np.concatenate([self.min_joint_values, goal_low, np.array([-reach, -reach])])
        self.observation_space = spaces.Box(low=low, high=high, dtype=np.float64)
        self.goal_space = spaces.Box(low=goal_low, high=goal_high, dtype=np.float64)

        self.goal = np.zeros(2)
        self.goal_pub = rospy.Publisher("/plane_arm/goal_pos", Point, queue_size=1)

        """
        Init super class.
        """
        super(PlaneArmReachEnv, self).__init__()
        rospy.loginfo("Finished Init of Task env")

    def _set_episode_init_params(self):
        """
        Function to set some parameters, like the position of the robot, at the beginning of each episode.
        """
        self.set_joint_angles([0.0, 0.5])
        self.goal = self.goal_space.sample()
        self.goal_pub.publish(Point(x=self.goal[0], y=self.goal[1]))

    def _send_action(self, action):
        """
        Function to send an action to the robot
        """
        target = np.clip(np.array(self.get_joint_angles()) + action, self.min_joint_values, self.max_joint_values)
        self.set_joint_angles(target)
        rospy.sleep(0.04)

    def _get_observation(self):
        """
        Function to get the observation from the enviroment.
        """
        self.joint_values = self.get_joint_angles()
        self.tool_pos = self.get_tool_pos(self.joint_values)
        return np.concatenate([self.joint_values, self.goal, self.tool_pos])

    def _get_reward(self):
        """
        Function to get the reward from the enviroment.
        """
        distance = np.linalg.norm(self.tool_pos - self.goal)
        if distance <= self.tolerance_goal_pos:
            return self.reached_goal_reward
        return self.step_reward - self.mult_dist_reward * distance

    def _check_if_done(self):
        """
        Function to check if the episode is done.
        """
        done = bool(np.linalg.norm(self.tool_pos - self.goal) <= self.tolerance_goal_pos)
        if done:
            self.info["is_success"] = 1.0
        return done

    def get_tool_pos(self, joint_values):
        first, second = joint_values[0], joint_values[0] + joint_values[1]
        x = LINK_LENGTH * (np.cos(first) + np.cos(second))
        y = LINK_LENGTH * (np.sin(first) + np.sin(second))
        return np.array([x, y])

    def get_params(self):
        """
        Get configuration parameters
        """
        self.max_joint_step = rospy.get_param("/plane_arm/max_joint_step")
        min_joint_pos = rospy.get_param("/plane_arm/min_joint_pos")
        max_joint_pos = rospy.get_param("/plane_arm/max_joint_pos")
        self.min_joint_values = np.array([min_joint_pos["shoulder"], min_joint_pos["elbow"]])
        self.max_joint_values = np.array([max_joint_pos["shoulder"], max_joint_pos["elbow"]])
        self.position_goal_min = rospy.get_param("/plane_arm/position_goal_min")
        self.position_goal_max = rospy.get_param("/plane_arm/position_goal_max")
        self.tolerance_goal_pos = rospy.get_param("/plane_arm/tolerance_goal_pos")
        self.step_reward = rospy.get_param("/plane_arm/step_reward")
        self.mult_dist_reward = rospy.get_param("/plane_arm/multiplier_dist_reward")
        self.reached_goal_reward = rospy.get_param("/plane_arm/reached_goal_reward")

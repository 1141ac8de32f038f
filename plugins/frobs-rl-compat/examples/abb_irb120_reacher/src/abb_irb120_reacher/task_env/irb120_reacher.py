#!/bin/python3

import numpy as np
import rospy
from frobs_rl.common import ros_params
from geometry_msgs.msg import Point, PointStamped
from gymnasium import spaces
from gymnasium.envs.registration import register

from abb_irb120_reacher.robot_env import irb120

register(
    id="ABBIRB120ReacherEnv-v0",
    entry_point="abb_irb120_reacher.task_env.irb120_reacher:ABBIRB120ReacherEnv",
    max_episode_steps=10000,
)


class ABBIRB120ReacherEnv(irb120.ABBIRB120Env):
    """
    The robot brings its flange to a goal.
    """

    def __init__(self):
        """
        Load YAML param file
        """
        ros_params.ros_load_yaml_from_pkg("abb_irb120_reacher", "reacher_task.yaml", ns="/")
        self.get_params()

        """
        Define the action and observation space.
        """
        # --- An action is a step of each joint
        self.action_space = spaces.Box(low=-self.max_joint_step, high=self.max_joint_step, shape=(6,), dtype=np.float32)

        # --- Vector from EE to goal, goal, joint angles
        one = np.ones(3)
        high = np.concatenate([one, self.position_goal_max, self.max_joint_values])
        low = np.concatenate([-one, self.position_goal_min, self.min_joint_values])
        self.observation_space = spaces.Box(low=low, high=high, dtype=np.float64)

        self.goal = np.array([0.35, 0.0, 0.4])
        self.goal_sub = rospy.Subscriber("goal_pos", Point, self.goal_callback)
        self.marker_pub = rospy.Publisher("goal_marker", PointStamped, queue_size=1)

        """
        Init super class.
        """
        super(ABBIRB120ReacherEnv, self).__init__()
        rospy.loginfo("Finished Init of ABBIRB120ReacherEnv Task Env")

    def goal_callback(self, goal):
        """
        The goal of those who do not train
        """
        if not self.training:
            self.goal = np.array([goal.x, goal.y, goal.z])

    def _set_episode_init_params(self):
        """
        Function to set the initial position of the robot and the goal.
        """
        self.set_trajectory_joints(np.zeros(6), 0.5)
        rospy.sleep(0.6)
        if self.training:
            self.goal = self.sample_goal()
        marker = PointStamped(point=Point(*self.goal))
        marker.header.frame_id = "world"
        self.marker_pub.publish(marker)

    def _send_action(self, action):
        """
        The actions are steps of the joints
        """
        target = np.clip(self.get_joint_angles() + action, self.min_joint_values, self.max_joint_values)
        self.set_trajectory_joints(target, self.step_duration)

    def _get_observation(self):
        """
        Where the goal is seen from the EE, the goal, and the joints
        """
        self.joint_values = self.get_joint_angles()
        self.ee_pos = self.get_ee_pos(self.joint_values)
        vec_EE_GOAL = self.goal - self.ee_pos
        vec_EE_GOAL = vec_EE_GOAL / max(np.linalg.norm(vec_EE_GOAL), 1e-6)
        return np.concatenate([vec_EE_GOAL, self.goal, self.joint_values])

    def _get_reward(self):
        """
        The nearer the better, and no joint at its limit
        """
        distance = np.linalg.norm(self.goal - self.ee_pos)
        if distance <= self.tolerance_goal_pos:
            reward = self.reached_goal_reward
        else:
            reward = -self.mult_dist_reward * distance + self.step_reward
        at_limit = np.any(self.joint_values <= self.min_joint_values + 0.0001) or np.any(
            self.joint_values >= self.max_joint_values - 0.0001
        )
        return float(reward + at_limit * self.joint_limits_reward)

    def _check_if_done(self):
        """
        Check if the EE is close enough to the goal
        """
        done = bool(np.linalg.norm(self.goal - self.ee_pos) <= self.tolerance_goal_pos)
        if done:
            self.info["is_success"] = 1.0
        return done

    def sample_goal(self):
        """
        A goal that the robot can reach: where the EE is for some joint angles
        """
        for _ in range(1000):
            goal = self.get_ee_pos(self.np_random.uniform(self.min_joint_values, self.max_joint_values))
            if np.all(goal >= self.position_goal_min + [0, 0, 0.1]) and np.all(goal <= self.position_goal_max):
                return goal
        return np.array([0.35, 0.0, 0.4])

    def get_params(self):
        """
        Get configuration parameters
        """
        self.max_joint_step = rospy.get_param("/irb120_reacher/max_joint_step")
        self.min_joint_values = np.array(rospy.get_param("/irb120_reacher/min_joint_pos"))
        self.max_joint_values = np.array(rospy.get_param("/irb120_reacher/max_joint_pos"))
        self.position_goal_min = np.array(rospy.get_param("/irb120_reacher/position_goal_min"))
        self.position_goal_max = np.array(rospy.get_param("/irb120_reacher/position_goal_max"))
        self.tolerance_goal_pos = rospy.get_param("/irb120_reacher/tolerance_goal_pos")
        self.step_reward = rospy.get_param("/irb120_reacher/step_reward")
        self.mult_dist_reward = rospy.get_param("/irb120_reacher/multiplier_dist_reward")
        self.reached_goal_reward = rospy.get_param("/irb120_reacher/reached_goal_reward")
        self.joint_limits_reward = rospy.get_param("/irb120_reacher/joint_limits_reward")
        self.training = rospy.get_param("/irb120_reacher/training")

#!/bin/python3
"""Trains: train.py [TD3_FILE], a file of this package's config folder."""

import sys

import gymnasium as gym
import rospkg
import rospy
from abb_irb120_reacher.task_env import irb120_reacher
from frobs_rl.common import ros_gazebo, ros_node

# Import TD3 algorithm
from frobs_rl.models.td3 import TD3
from frobs_rl.wrappers.NormalizeActionWrapper import NormalizeActionWrapper
from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper
from frobs_rl.wrappers.TimeLimitWrapper import TimeLimitWrapper

if __name__ == "__main__":
    # Kill all processes related to previous runs
    ros_node.ros_kill_all_processes()

    # Launch Gazebo
    ros_gazebo.launch_Gazebo(paused=True, gui=False)

    # Start node
    rospy.logwarn("Start")
    rospy.init_node("train_irb120_reacher")

    # Launch the task environment
    env = gym.make("ABBIRB120ReacherEnv-v0")
    env = NormalizeActionWrapper(env)
    env = NormalizeObservationWrapper(env)
    env = TimeLimitWrapper(env, max_steps=100)
    env.reset()

    # --- Set the save and log path
    pkg_path = rospkg.RosPack().get_path("abb_irb120_reacher")
    save_path = pkg_path + "/models/td3/"
    log_path = pkg_path + "/logs/td3/"
    config = sys.argv[1] if len(sys.argv) > 1 else "td3.yaml"
    model = TD3(env, save_path, log_path, config_file_pkg="abb_irb120_reacher", config_filename=config)

    # --- Train the model and save it
    model.train()
    model.save_model()
    model.close_env()

    sys.exit()

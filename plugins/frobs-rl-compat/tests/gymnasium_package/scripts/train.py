#!/bin/python3

import sys

import gymnasium as gym
import rospkg
import rospy
from frobs_rl.common import ros_gazebo, ros_node

# Import TD3 algorithm
from frobs_rl.models.td3 import TD3
from frobs_rl.wrappers.NormalizeActionWrapper import NormalizeActionWrapper
from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper
from frobs_rl.wrappers.TimeLimitWrapper import TimeLimitWrapper

from gymnasium_package.task_env import plane_arm_reach  # noqa: F401

if __name__ == "__main__":
    # Kill all processes related to previous runs
    ros_node.ros_kill_all_processes()

    # Launch Gazebo
    ros_gazebo.launch_Gazebo(paused=True, gui=False)

    # Start node
    rospy.logwarn("Start")
    rospy.init_node("plane_arm_train")

    # Launch the task environment
    env = gym.make("PlaneArmReachGymnasiumEnv-v0")

    # --- Normalize action space
    env = NormalizeActionWrapper(env)

    # --- Normalize observation space
    env = NormalizeObservationWrapper(env)

    # --- Set max steps
    env = TimeLimitWrapper(env, max_steps=20)
    env.reset()

    # --- Set the save and log path
    rospack = rospkg.RosPack()
    pkg_path = rospack.get_path("gymnasium_package")

    # -- TD3
    save_path = pkg_path + "/models/td3/"
    log_path = pkg_path + "/logs/td3/"
    model = TD3(env, save_path, log_path, config_file_pkg="gymnasium_package", config_filename="td3.yaml")

    model.train()
    model.save_model()
    model.close_env()

    sys.exit()

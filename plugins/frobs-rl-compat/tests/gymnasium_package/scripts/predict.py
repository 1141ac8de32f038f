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
    rospy.init_node("plane_arm_test")

    # Launch the task environment
    env = gym.make("PlaneArmReachGymnasiumEnv-v0")
    env = NormalizeActionWrapper(env)
    env = NormalizeObservationWrapper(env)
    env = TimeLimitWrapper(env, max_steps=10)
    env.reset()

    rospack = rospkg.RosPack()
    pkg_path = rospack.get_path("gymnasium_package")
    save_path = pkg_path + "/models/td3/"

    # -- TD3 trained
    model = TD3.load_trained(save_path + "trained_model")

    obs, _ = env.reset()
    episodes = 2
    epi_count = 0
    while epi_count < episodes:
        action, _states = model.predict(obs, deterministic=True)
        obs, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            epi_count += 1
            rospy.logwarn("Episode: " + str(epi_count) + " success " + str(info["is_success"]))
            obs, _ = env.reset()

    env.close()
    sys.exit()

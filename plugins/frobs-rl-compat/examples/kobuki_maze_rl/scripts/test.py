#!/bin/python3
"""Runs the trained model for ten episodes."""

import sys

import gym
import rospkg
import rospy
from kobuki_maze_rl.task_env import kobuki_maze
from frobs_rl.common import ros_gazebo, ros_node
from frobs_rl.models.td3 import TD3
from frobs_rl.wrappers.NormalizeActionWrapper import NormalizeActionWrapper
from frobs_rl.wrappers.NormalizeObservationWrapper import NormalizeObservationWrapper
from frobs_rl.wrappers.TimeLimitWrapper import TimeLimitWrapper

if __name__ == "__main__":
    ros_node.ros_kill_all_processes()
    ros_gazebo.launch_Gazebo(paused=True, gui=False, custom_world_pkg="kobuki_maze_rl", custom_world_name="maze.world")
    rospy.init_node("test_kobuki_maze")

    env = gym.make("KobukiMazeEnv-v0")
    env = NormalizeActionWrapper(env)
    env = NormalizeObservationWrapper(env)
    env = TimeLimitWrapper(env, max_steps=2000)

    pkg_path = rospkg.RosPack().get_path("kobuki_maze_rl")
    model = TD3.load_trained(pkg_path + "/models/td3/trained_model")

    reached = 0.0
    for episode in range(10):
        obs = env.reset()
        ended = False
        while not ended:
            action, _states = model.predict(obs, deterministic=True)
            obs, _, ended, info = env.step(action)
        reached += info["is_success"]
        rospy.logwarn("Episode " + str(episode + 1) + ": reached " + str(info["is_success"]))
    rospy.logwarn("Reached " + str(reached) + " of 10")

    env.close()
    sys.exit()

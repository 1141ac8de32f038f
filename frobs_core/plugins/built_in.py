"""Where well-known names come from, so that a look-up that fails can say what to install. Nothing else uses it."""

from __future__ import annotations

from collections.abc import Mapping

BUILT_IN: Mapping[str, Mapping[str, str]] = {
    "simulator": {"mujoco": "frobs-sim-mujoco", "pybullet": "frobs-sim-pybullet", "gazebo": "frobs-sim-gazebo"},
    "robot": {
        "irb120": "frobs-robots-abb",
        "irb140": "frobs-robots-abb",
        "ur5": "frobs-robots-ur",
        "kobuki": "frobs-robots-kobuki",
    },
    "task": {
        "reach": "frobs-tasks-reach",
        "navigate": "frobs-tasks-navigation",
        "navigate_legacy": "frobs-tasks-navigation",
    },
    "controller": {
        "joint_position": "frobs-controllers",
        "joint_delta_position": "frobs-controllers",
        "tcp_delta_position": "frobs-controllers",
        "differential_drive": "frobs-controllers",
        "trajectory": "frobs-controllers-planning",
    },
    "algorithm": dict.fromkeys(("ppo", "sac", "td3", "ddpg", "a2c", "dqn"), "frobs-algos-sb3"),
}
"""The distribution of each name, by kind."""

COMMANDS = {"migrate": "frobs-rl-compat", "ros": "frobs-ros", "legacy": "frobs-rl-compat"}

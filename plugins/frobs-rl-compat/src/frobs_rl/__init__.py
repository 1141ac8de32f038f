"""The import names of FRobs_RL, implemented with FRobs.

    common/      ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn, ros_urdf: from frobs_ros
    envs/        robot_BasicEnv, the base class of environments
    models/      the algorithms: from frobs_algos_sb3
    wrappers/    the three wrappers: from frobs_core
    templates/   CustomRobotEnv and CustomTaskEnv, to inherit or to copy
    config/      the six default YAML files

This folder is also the ROS package ``frobs_rl``: ``package.xml`` is next to this file.
"""

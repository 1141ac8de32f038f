"""The import names of FRobs_RL, over FRobs.

    common/      ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn, ros_urdf: of frobs_ros
    envs/        robot_BasicEnv, the base class of environments
    models/      the algorithms: of frobs_algos_sb3
    wrappers/    the three wrappers: of frobs_core
    templates/   CustomRobotEnv and CustomTaskEnv, to inherit or to copy
    config/      the six default YAML files

This folder is the ROS package ``frobs_rl`` too: ``package.xml`` lies beside this file.
"""

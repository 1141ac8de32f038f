"""FRobs_RL's modules under their original import names, implemented with FRobs.

- ``common/``: helpers for ROS and Gazebo, from ``frobs_ros``
- ``envs/``: the base class for environments, ``robot_BasicEnv``
- ``models/``: the algorithms, from ``frobs_algos_sb3``
- ``wrappers/``: the three environment wrappers, from ``frobs_core``
- ``templates/``: ``CustomRobotEnv`` and ``CustomTaskEnv``, which packages can subclass or copy
- ``config/``: the six default YAML files

This folder is also the ROS package ``frobs_rl``, which is why it contains a ``package.xml``.
"""

"""Everything that exists only for FRobs_RL, and support for running and migrating packages written for it.

- ``ros/``, ``gazebo/``: FRobs_RL's functions for ROS and Gazebo, and its base class for environments
- ``training/``: FRobs_RL's algorithm classes and YAML files
- ``wrappers/``: FRobs_RL's wrappers
- ``legacy.py``: environment variables that ``frobs legacy`` sets for packages written for FRobs_RL
- ``overlay/``: the replacements for ``gym`` and ``moveit_commander`` that these packages import
- ``startup_patches.py``: names of earlier versions of NumPy, restored in processes of ``frobs legacy run``
- ``replacements/``, ``ros_packages/``: replacements for ROS packages that are not installed
- ``old_gym/``, ``moveit/``: implementations of the replacements for ``gym`` and ``moveit_commander``
- ``gym_api.py``: conversion between the old gym API and Gymnasium's API
- ``migrate/``: conversion of FRobs_RL packages to plugins, used by ``frobs migrate``

Importing this package does not import its modules.
"""

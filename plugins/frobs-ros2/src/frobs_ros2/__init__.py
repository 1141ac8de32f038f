"""Connects FRobs to ROS 2 through rclpy.

    ros.py          finds rclpy and message types, and starts nodes
    safety.py       limits commands, checks measurements, and logs every changed command
    policy_node/    runs a policy bundle as a node; requires only frobs-deploy and rclpy
    serve/          offers an environment's robots with the topics and services of a real robot
    simulation.py   a robot behind ROS 2 topics as a paced simulation
    safe.py         adds the safety rules to any paced simulation

The first three also run on Python 3.10 and do not import the core.
"""

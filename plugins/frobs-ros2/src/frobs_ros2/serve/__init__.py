"""Offers the robots of an environment with the topics and services that ros2_control and ros_gz users expect.

controller.py   lets topics, instead of actions, command the joints
trajectory.py   interpolates joint trajectories
robot.py        the command topics of one robot, and its watchdog
measurements.py what one robot publishes
server.py       the loop, the clock, the services and the episodes
"""

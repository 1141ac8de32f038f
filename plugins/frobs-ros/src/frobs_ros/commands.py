"""Declares the commands of this distribution as strings, so that listing the commands does not import them."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(
        name="ros", summary="Work with ROS 1: simulate robots with Gazebo's interface, and run policies on robots."
    ),
    Command(
        name="ros serve",
        summary="Run a simulation with the ROS topics and services of Gazebo.",
        function="frobs_ros.cli.serve:serve",
    ),
    Command(
        name="ros run",
        summary="Run a policy on a robot that is controlled through ROS.",
        function="frobs_ros.cli.run:run",
    ),
    Command(
        name="doctor ros",
        summary="Check whether ROS 1 can be used on this machine.",
        function="frobs_ros.cli.doctor_ros:ros",
    ),
)

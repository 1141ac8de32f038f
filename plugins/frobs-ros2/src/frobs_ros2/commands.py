"""Declares the commands of this distribution as strings, so that listing the commands does not import them."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(name="ros2", summary="Work with ROS 2: simulated robots as topics, and policies as nodes."),
    Command(
        name="ros2 serve",
        summary="Run an environment's robots with the ROS 2 topics of real robots.",
        function="frobs_ros2.cli.serve:serve",
    ),
    Command(
        name="ros2 run",
        summary="Run a policy as a ROS 2 node.",
        function="frobs_ros2.cli.run:run",
    ),
)

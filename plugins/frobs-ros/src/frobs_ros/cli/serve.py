"""Implements ``frobs ros serve``, which runs a FRobs simulation with Gazebo's ROS interface."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def serve(
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default="an empty world",
            help="Robot to place in the initial world: a name from 'frobs list robots', or a URDF, xacro or MJCF file.",
        ),
    ] = None,
    simulator: Annotated[
        str, typer.Option(metavar="NAME", help="Simulator: a name from 'frobs list simulators'.")
    ] = "mujoco",
    namespace: Annotated[str, typer.Option(metavar="NS", help="Namespace of the robot's topics and services.")] = "/",
    model_name: Annotated[
        str,
        typer.Option(metavar="NAME", show_default="the robot's name", help="Name of the robot's model in the world."),
    ] = "",
    world: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", exists=True, dir_okay=False, show_default="a ground plane", help="SDF world file to load."
        ),
    ] = None,
    paused: Annotated[bool, typer.Option("--paused", help="Start with simulated time paused.")] = False,
    timestep: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", show_default="from the world file, or 0.001", help="Duration of a physics step."
        ),
    ] = None,
    max_update_rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            min=0.0,
            show_default="from the world file, or real time",
            help="Maximum number of physics steps per second; 0 means as fast as possible.",
        ),
    ] = None,
    clock_frequency: Annotated[
        float,
        typer.Option(
            metavar="HZ", min=0.0, help="Rate of the /clock topic in simulated time; 0 publishes after every step."
        ),
    ] = 100.0,
    state_frequency: Annotated[
        float,
        typer.Option(metavar="HZ", min=0.0, help="Rate of the model_states and link_states topics in simulated time."),
    ] = 100.0,
    gui: Annotated[bool, typer.Option("--gui", help="Open a window that shows the world.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Log everything.")] = False,
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            show_default="this machine only",
            help="Address at which other machines can reach this machine. If this option is set, the server listens on "
            "all interfaces.",
        ),
    ] = None,
) -> None:
    """Run a simulation with the ROS services, topics and controller managers of Gazebo.

    A ROS master must be running. Press Ctrl-C to stop.

    Example:
        $ frobs ros serve --robot irb120 --simulator mujoco
        $ frobs ros serve --simulator pybullet --world maze.world --paused
    """
    options = dict(locals())
    from frobs_ros.bridge import node

    node.serve(node.Options(**options))


def main() -> None:
    """Run the command as ``python -m frobs_ros.bridge``, without the ``frobs`` program, and exit the process."""
    from frobs_cli.group import FrobsGroup

    app = typer.Typer(cls=FrobsGroup, pretty_exceptions_enable=False)
    app.command("serve")(serve)
    app.callback()(lambda: None)
    app(args=["serve", *sys.argv[1:]], prog_name="python -m frobs_ros.bridge")

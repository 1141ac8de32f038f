"""Implements ``frobs ros serve``, which runs a FRobs simulation with Gazebo's ROS interface."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from frobs_cli.field_options import option, with_options


@dataclass(frozen=True, kw_only=True)
class ServeOptions:
    """Options of ``frobs ros serve``.

    Attributes:
        robot: Robot to place in the initial world: a name from 'frobs list robots', or a URDF, xacro or MJCF file.
        simulator: Simulator: a name from 'frobs list simulators'.
        namespace: Namespace of the robot's topics and services.
        model_name: Name of the robot's model in the world.
        world: SDF world file to load.
        paused: Start with simulated time paused.
        timestep: Duration of a physics step.
        max_update_rate: Maximum number of physics steps per second; 0 means as fast as possible.
        clock_frequency: Rate of the /clock topic in simulated time; 0 publishes after every step.
        state_frequency: Rate of the model_states and link_states topics in simulated time.
        gui: Open a window that shows the world.
        verbose: Log everything.
        listen: Address at which other machines can reach this machine. If this option is set, the server listens on all
            interfaces.
    """

    robot: str | None = option(None, show_default="an empty world")
    simulator: str = option("mujoco")
    namespace: str = option("/", metavar="NS")
    model_name: str = option("", show_default="the robot's name")
    world: Path | None = option(None, exists=True, dir_okay=False, show_default="a ground plane")
    paused: bool = option(False)
    timestep: float | None = option(None, metavar="SECONDS", show_default="from the world file, or 0.001")
    max_update_rate: float | None = option(
        None, metavar="HZ", min=0.0, show_default="from the world file, or real time"
    )
    clock_frequency: float = option(100.0, metavar="HZ", min=0.0)
    state_frequency: float = option(100.0, metavar="HZ", min=0.0)
    gui: bool = option(False)
    verbose: bool = option(False)
    listen: str | None = option(None, metavar="ADDRESS", show_default="this machine only")


def serve(options: ServeOptions) -> None:
    """Run a simulation with the ROS services, topics and controller managers of Gazebo.

    A ROS master must be running. Press Ctrl-C to stop.

    Example:
        $ frobs ros serve --robot irb120 --simulator mujoco
        $ frobs ros serve --simulator pybullet --world maze.world --paused
    """
    from frobs_ros.bridge import node

    node.serve(options)


def main() -> None:
    """Run the command as ``python -m frobs_ros.bridge``, without the ``frobs`` program, and exit the process."""
    from frobs_cli.group import FrobsGroup

    app = typer.Typer(cls=FrobsGroup, pretty_exceptions_enable=False)
    app.command("serve", help=serve.__doc__)(with_options(serve))
    app.callback()(lambda: None)
    app(args=["serve", *sys.argv[1:]], prog_name="python -m frobs_ros.bridge")

"""Implements ``frobs ros2 run``, which runs a policy as a node."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from frobs_cli.options import Json
from frobs_ros2.cli.serve import Namespace, Network, Param, Remap


def run(
    bundle: Annotated[
        str,
        typer.Argument(
            metavar="BUNDLE", show_default=False, help="File from 'frobs export', or an ID with a pretrained policy."
        ),
    ],
    goal: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z", show_default="from a topic", help="Goal of the task in the world frame in meters."
        ),
    ] = None,
    interface: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help="Type of the commands: 'forward' (Float64MultiArray) or 'trajectory' (JointTrajectory).",
        ),
    ] = "forward",
    topic: Annotated[
        str,
        typer.Option(
            metavar="TOPIC", show_default="the usual name", help="Topic of the controller that gets commands."
        ),
    ] = "",
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Act once for each step of 'frobs ros2 serve --lockstep'.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Log the commands instead of sending them.")] = False,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", show_default="no limit", help="End after this many seconds.")
    ] = None,
    speed: Annotated[
        float, typer.Option(metavar="X", help="Fraction of the velocity limits that commands may use.")
    ] = 1.0,
    acceleration: Annotated[
        float | None,
        typer.Option(metavar="A", show_default="no limit", help="Acceleration limit of the joints, in rad/s² or m/s²."),
    ] = None,
    workspace: Annotated[
        tuple[float, float, float, float, float, float] | None,
        typer.Option(
            metavar="X Y Z X Y Z",
            show_default="no limit",
            help="Box that the tool may not leave: two corners in meters.",
        ),
    ] = None,
    slow_start: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="Seconds until the full velocity limit applies.")
    ] = 2.0,
    max_age: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="The robot holds if measurements are older than this.")
    ] = 0.2,
    deadman: Annotated[
        bool, typer.Option("--deadman", help="Hold unless the topic 'deadman' (std_msgs/Bool) is true and fresh.")
    ] = False,
    log: Annotated[
        Path | None,
        typer.Option(metavar="FILE", show_default="none", help="File for the commands that the safety rules changed."),
    ] = None,
    namespace: Namespace = "",
    remap: Remap = None,
    param: Param = None,
    network: Network = False,
    json: Json = False,
) -> None:
    """Run a policy on a robot that is controlled through ROS 2, until Ctrl-C is pressed.

    The robot is compared with the policy before the first command. Software limits do not replace the robot's emergency
    stop, so keep a hand on it.

    Example:
        $ frobs ros2 run reach.frobs --goal 0.3 0.1 0.5 --dry-run
        $ frobs ros2 run frobs/Irb120Reach-v0 --lockstep
    """
    from dataclasses import asdict

    from frobs_cli.output import print_json, print_line
    from frobs_core.plugins.registry import pretrained_path
    from frobs_ros2.policy_node.command_line import run as run_node
    from frobs_ros2.policy_node.node import Settings
    from frobs_ros2.ros import ros_arguments

    path, laws = Path(bundle), []
    if path.suffix != ".frobs" and not path.is_file():
        path = Path(pretrained_path(bundle))
        laws = _laws(bundle, path)
    settings = Settings(
        bundle=path, laws=laws, goal=goal, interface=interface, topic=topic, lockstep=lockstep, dry_run=dry_run, seconds=seconds,
        speed=speed, acceleration=acceleration, workspace=workspace, slow_start=slow_start, max_age=max_age,
        deadman=deadman, log=log,
    )  # fmt: skip
    report = run_node(settings, ros_arguments(remap or (), param or (), namespace), network)
    if json:
        print_json(asdict(report))
    else:
        median, most = report.cycle_ms
        print_line(
            f"{report.commands:,} commands, {report.late} late, {report.holds} holds; from joint state to command: "
            f"{median:.2f} ms (median), {most:.2f} ms (99 %)"
        )


def _laws(id: str, path: Path) -> list[Mapping[str, Any]]:
    """Return the laws of an ID's controllers if the node needs them and the bundle, of an earlier version, has none."""
    from contextlib import closing

    import gymnasium as gym

    from frobs_deploy import read_bundle

    data = read_bundle(path).manifest
    robot, controller = data["robot"] or {"joints": ()}, data["controller"] or {"name": ""}
    by_joint = str(controller["name"]).startswith("joint_") and data["action"]["space"]["shape"] == [
        len(robot["joints"])
    ]
    if "laws" in controller or by_joint:
        return []
    made: Any = gym.make(f"frobs_core:{id.removeprefix('frobs_core:')}", disable_env_checker=True).unwrapped
    with closing(made) as env:
        return [one.law() for one in env.control.controllers.values()]

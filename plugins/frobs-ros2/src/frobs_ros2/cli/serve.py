"""Implements ``frobs ros2 serve``, which offers an environment's robots with the topics of real robots."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from frobs_cli.options import EnvId, Json
from frobs_cli.options import Robot as RobotOption

Remap = Annotated[
    list[str] | None,
    typer.Option(metavar="FROM:=TO", show_default="none", help="Rename a topic or service; may be repeated."),
]
Param = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME:=VALUE", show_default="none", help="Set a ROS parameter; may be repeated."),
]
Namespace = Annotated[
    str, typer.Option(metavar="NS", show_default="none", help="Namespace of all topics and services.")
]
Network = Annotated[
    bool, typer.Option("--network", help="Also reach nodes on other machines. By default, only this one is reached.")
]


def serve(
    id: EnvId,
    simulator: Annotated[
        str | None,
        typer.Option(metavar="NAME", show_default="the environment's simulator", help="Simulator to serve."),
    ] = None,
    robot: RobotOption = None,
    lockstep: Annotated[
        bool,
        typer.Option(
            "--lockstep", help="Advance by one control step per command, instead of continuously in real time."
        ),
    ] = False,
    rate: Annotated[
        float, typer.Option(metavar="HZ", min=1.0, help="Rate of the measurements; --lockstep ignores it.")
    ] = 100.0,
    watchdog: Annotated[
        float,
        typer.Option(
            metavar="S", min=0.0, help="Time without a forwarded command after which the robot holds; 0 disables it."
        ),
    ] = 0.2,
    episodes: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="End after N episodes, and print their success; 0 serves without end."),
    ] = 0,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the first episode.")] = 0,
    namespace: Namespace = "",
    remap: Remap = None,
    param: Param = None,
    network: Network = False,
    json: Json = False,
) -> None:
    """Run an environment's robots with the ROS 2 topics and services of real robots, until Ctrl-C is pressed.

    Example:
        $ frobs ros2 serve frobs/Irb120Reach-v0
        $ frobs ros2 serve frobs/KobukiMaze-v0 --lockstep --episodes 20
    """
    from contextlib import closing

    from frobs_cli.output import print_json, print_line, print_note
    from frobs_ros2.ros import Node, advice, ros_arguments, running
    from frobs_ros2.serve.server import Server, Settings

    kwargs: dict[str, Any] = {"simulator": simulator} if simulator else {}
    kwargs |= {"robot": robot} if robot else {}
    settings = Settings(
        id=id, kwargs=kwargs, lockstep=lockstep, rate=rate, watchdog=watchdog, episodes=episodes, seed=seed
    )
    with running(Node("frobs_server", ros_arguments(remap or (), param or (), namespace), network)) as node:
        with closing(Server(node, settings)) as server:
            print_note(f"serving {id}; press Ctrl-C to stop; {advice()}")
            node.stop_on_signals()
            server.run()
        results = server.successes
    if json:
        print_json({"episodes": len(results), "successes": sum(results)})
    elif results:
        print_line(f"{sum(results)} of {len(results)} episodes successful")

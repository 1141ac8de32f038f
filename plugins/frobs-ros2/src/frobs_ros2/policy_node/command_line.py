"""Starts the policy node from a command line, without the ``frobs`` program."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from frobs_deploy import DeployError
from frobs_ros2.policy_node.node import PolicyNode, Report, Settings
from frobs_ros2.ros import Node, advice, running


def run(settings: Settings, arguments: Sequence[str] = (), network: bool = False) -> Report:
    """Run a policy until Ctrl-C is pressed or the time is over.

    Args:
        settings: The settings.
        arguments: Arguments for rclpy, from :func:`frobs_ros2.ros.ros_arguments`.
        network: Whether to reach other machines.

    Raises:
        DeployError: The bundle or the robot cannot be used.
    """
    with running(Node("frobs_policy", arguments, network, parameter_services=False)) as node:
        print(f"running {settings.bundle}; press Ctrl-C to stop; {advice()}", file=sys.stderr, flush=True)  # noqa: T201
        node.stop_on_signals()
        return PolicyNode(node, settings).run()


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="python -m frobs_ros2.policy_node",
        description="Run a policy as a ROS 2 node. ROS arguments follow --ros-args.",
    )
    add = made.add_argument
    add("bundle", type=Path, help="bundle that 'frobs export' wrote")
    add("--goal", type=float, nargs=3, metavar=("X", "Y", "Z"), help="goal in the world frame in meters")
    add("--interface", choices=("forward", "trajectory"), default="forward", help="type of the commands")
    add("--topic", default="", help="topic of the commands")
    add("--lockstep", action="store_true", help="act once for each step of 'frobs ros2 serve --lockstep'")
    add("--dry-run", action="store_true", help="print the commands instead of sending them")
    add("--seconds", type=float, help="end after this many seconds")
    add("--speed", type=float, default=1.0, help="fraction of the velocity limits that commands may use")
    add("--acceleration", type=float, help="acceleration limit of the joints")
    add("--workspace", type=float, nargs=6, metavar="M", help="lower and upper corner of the tool's box in meters")
    add("--slow-start", type=float, default=2.0, help="seconds until the full velocity limit applies")
    add("--max-age", type=float, default=0.2, help="hold if measurements are older, in seconds")
    add("--deadman", action="store_true", help="hold unless the topic deadman is true")
    add("--log", type=Path, help="file for commands that were changed")
    add("--network", action="store_true", help="also reach other machines")
    return made


def main(arguments: Sequence[str]) -> int:
    """Run the policy, print statistics as JSON, and return the exit status."""
    words = list(arguments)
    count = words.index("--ros-args") if "--ros-args" in words else len(words)
    options = vars(parser().parse_args(words[:count]))
    network = options.pop("network")
    try:
        report = run(Settings(**options), words[count:], network)
    except DeployError as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 2
    print(json.dumps(asdict(report), allow_nan=False))  # noqa: T201
    return 0

"""Implements ``frobs ros run``, which runs a trained policy on a robot controlled through ROS."""

from __future__ import annotations

import contextlib
import signal
from pathlib import Path
from typing import Annotated, Literal

import typer

from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note


def run(
    bundle: Annotated[
        str,
        typer.Argument(
            metavar="BUNDLE",
            show_default=False,
            help="Bundle that 'frobs export' wrote. With --policy pretrained: a Gymnasium environment ID.",
        ),
    ],
    policy: Annotated[
        Literal["pretrained"] | None,
        typer.Option(show_default=False, help="Use the trained policy that comes with the environment ID."),
    ] = None,
    pretrained: Annotated[bool, typer.Option("--pretrained", help="Short form of --policy pretrained.")] = False,
    robot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            show_default=False,
            help="Model file of your robot, to be compared with the robot on which the policy was trained.",
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(metavar="NS", help="ROS namespace of the robot.")] = "/",
    controller: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            show_default=False,
            help="ROS controller that receives the commands. By default, wheeled robots use the topic cmd_vel.",
        ),
    ] = None,
    goal: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z",
            show_default=False,
            help="Goal position in meters; wheeled robots use only X and Y. Default: sampled by the task.",
        ),
    ] = None,
    joint_states: Annotated[
        str, typer.Option(metavar="TOPIC", help="Topic that publishes the measured joint states.")
    ] = "joint_states",
    odom: Annotated[
        str, typer.Option(metavar="TOPIC", help="Topic that publishes the measured odometry of a mobile base.")
    ] = "odom",
    scan: Annotated[str, typer.Option(metavar="TOPIC", help="Topic of the lidar scans.")] = "scan",
    goal_topic: Annotated[
        str, typer.Option(metavar="TOPIC", help="Topic for new goals (message type Point).")
    ] = "goal_pos",
    speed: Annotated[
        float, typer.Option(metavar="X", help="Maximum speed, as a fraction of the joints' velocity limits.")
    ] = 1.0,
    timeout: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="Stop if no measurements arrive for this many seconds.")
    ] = 0.5,
    seconds: Annotated[
        float | None,
        typer.Option(metavar="S", show_default=False, help="Stop after this many seconds of ROS time."),
    ] = None,
    simulator: Annotated[
        str, typer.Option(metavar="NAME", help="Simulator used to mirror the robot's state.")
    ] = "mujoco",
    json: Json = False,
) -> None:
    """Run a trained policy on a robot that is controlled through ROS, until Ctrl-C is pressed.

    The policy receives joint states and sends commands, which are clipped to the joint limits. When the run ends, or
    when measurements stop arriving, the robot is commanded to hold its position.

    Example:
        $ frobs ros run reach.frobs --controller arm_controller --goal 0.3 0.1 0.5
        $ frobs ros run frobs/KobukiMaze-v0 --policy pretrained --speed 0.5
    """
    import numpy as np

    from frobs_core.models import load_model
    from frobs_core.plugins.registry import pretrained_path
    from frobs_deploy import Policy, read_bundle, read_manifest
    from frobs_models import fingerprint
    from frobs_ros.policy_node.mirror import Mirror
    from frobs_ros.policy_node.policy_loop import Report, act
    from frobs_ros.policy_node.robot import RosRobot, Topics
    from frobs_ros.policy_node.visualization import Visualization
    from frobs_ros.ros.environment import use_ros

    opened = read_bundle(pretrained_path(bundle) if pretrained or policy else bundle)
    if robot is None:
        acting = Policy(opened)
    else:
        model = load_model(robot, xacro_args=read_manifest(opened).xacro_args)
        acting = Policy(opened, robot=fingerprint(model), joint_names=model.joint_names)
    mirror = Mirror(opened, simulator, speed)
    with contextlib.closing(mirror), only_json(json):
        use_ros()
        import rospy

        rospy.init_node("frobs_policy", anonymous=True, disable_signals=True)
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the run like Ctrl-C
        try:
            live = RosRobot(mirror, namespace, controller, Topics(joint_states, odom, scan, goal_topic))
            print_note(f"sending a command every {mirror.env.control_timestep:g} s; press Ctrl-C to stop")
            report: Report = act(
                live,
                mirror,
                acting,
                goal=None if goal is None else np.array(goal),
                timeout=timeout,
                seconds=seconds,
                on_step=Visualization(live, mirror, namespace).update,
            )
        finally:
            rospy.signal_shutdown("the policy ended")
    if json:
        print_json({**vars(report), "latency": str(acting.latency)})
    else:
        print_line(f"{report.steps:,} commands, {report.late} of them late; time per action: {acting.latency}")

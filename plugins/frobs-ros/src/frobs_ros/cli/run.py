"""``frobs ros run``: let a trained policy act on a robot behind ROS."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from frobs_cli.options import Json
from frobs_cli.output import only_json, print_json, print_line, print_note


def run(
    bundle: Annotated[
        str,
        typer.Argument(metavar="BUNDLE", show_default=False, help="A file of 'frobs export'; an ID with --pretrained."),
    ],
    pretrained: Annotated[bool, typer.Option("--pretrained", help="Take the policy that comes with an ID.")] = False,
    robot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", show_default=False, help="The robot's model file, to be compared with the policy's."
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(metavar="NS", help="The robot's.")] = "/",
    controller: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", show_default=False, help="Which gets the commands; a wheeled robot's cmd_vel without it."
        ),
    ] = None,
    goal: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z",
            show_default=False,
            help="Goal of the task in meters; wheeled robots use X and Y. Default: drawn by the task.",
        ),
    ] = None,
    joint_states: Annotated[str, typer.Option(metavar="TOPIC", help="Where joints are measured.")] = "joint_states",
    odom: Annotated[str, typer.Option(metavar="TOPIC", help="Where a moving base is measured.")] = "odom",
    scan: Annotated[str, typer.Option(metavar="TOPIC", help="Where a lidar is measured.")] = "scan",
    goal_topic: Annotated[str, typer.Option(metavar="TOPIC", help="Where other goals come (Point).")] = "goal_pos",
    speed: Annotated[float, typer.Option(metavar="X", help="Share of the velocity limits that may be used.")] = 1.0,
    timeout: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="How many seconds measurements may fail to come.")
    ] = 0.5,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", show_default=False, help="End after so many seconds, by ROS's clock.")
    ] = None,
    simulator: Annotated[str, typer.Option(metavar="NAME", help="Which mirrors the robot.")] = "mujoco",
    json: Json = False,
) -> None:
    """Let a trained policy act on a robot behind ROS, until Ctrl-C: joint states in, commands out.

    Commands keep the joints' limits. When measurements fail to come, and at the end, the robot is told to stay.

    Example:
        $ frobs ros run reach.frobs --controller arm_controller --goal 0.3 0.1 0.5
        $ frobs ros run frobs/KobukiMaze-v0 --pretrained --speed 0.5
    """
    import numpy as np

    from frobs_core.models import fingerprint, load_model
    from frobs_core.registry import pretrained_path
    from frobs_deploy import Policy, read_bundle, read_manifest
    from frobs_ros.environment import use_ros
    from frobs_ros.mirror import Mirror
    from frobs_ros.policy_loop import Report, act
    from frobs_ros.ros_robot import RosRobot, Topics
    from frobs_ros.visualization import Visualization

    opened = read_bundle(pretrained_path(bundle) if pretrained else bundle)
    if robot is None:
        policy = Policy(opened)
    else:
        model = load_model(robot, xacro_args=read_manifest(opened).xacro_args)
        policy = Policy(opened, robot=fingerprint(model), joint_names=model.joint_names)
    mirror = Mirror(opened, simulator, speed)
    with contextlib.closing(mirror), only_json(json):
        use_ros()
        import rospy

        rospy.init_node("frobs_policy", anonymous=True, disable_signals=True)
        try:
            live = RosRobot(mirror, namespace, controller, Topics(joint_states, odom, scan, goal_topic))
            print_note(f"acting each {mirror.env.control_timestep:g} s; Ctrl-C ends it")
            report: Report = act(
                live,
                mirror,
                policy,
                goal=None if goal is None else np.array(goal),
                timeout=timeout,
                seconds=seconds,
                on_step=Visualization(live, mirror, namespace).update,
            )
        finally:
            rospy.signal_shutdown("the policy has ended")
    if json:
        print_json({**vars(report), "latency": str(policy.latency)})
    else:
        print_line(f"{report.steps:,} commands, {report.late} of them late; actions took {policy.latency}")

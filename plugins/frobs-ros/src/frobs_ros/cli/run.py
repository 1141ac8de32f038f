"""Implements ``frobs ros run``, which runs a trained policy on a robot controlled through ROS."""

from __future__ import annotations

import contextlib
import signal
from collections import deque
from pathlib import Path
from typing import Annotated, Any, Literal

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
    body: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=TOPIC", show_default=False, help="Topic with the pose of a body (PoseStamped)."),
    ] = None,
    simulator: Annotated[str | None, typer.Option(hidden=True, help="No effect since version 0.3.")] = None,
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
    from frobs_ros.bridge.poses import read_vector
    from frobs_ros.messages.types import find_type
    from frobs_ros.policy_node.running import act, make_env
    from frobs_ros.policy_node.visualization import Visualization
    from frobs_ros.ros.environment import use_ros
    from frobs_ros.ros.master import require
    from frobs_ros.ros.names import resolve

    opened = read_bundle(pretrained_path(bundle) if pretrained or policy else bundle)
    if robot is None:
        acting = Policy(opened)
    else:
        model = load_model(robot, xacro_args=read_manifest(opened).xacro_args)
        acting = Policy(opened, robot=fingerprint(model), joint_names=model.joint_names)
    bodies = dict(_name_and_topic(each) for each in body or ())
    with only_json(json):
        if simulator is not None:
            print_note("--simulator has no effect any more; observations are computed from measurements only")
        use_ros()
        import rospy

        require()
        rospy.init_node("frobs_policy", anonymous=True, disable_signals=True)
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the run like Ctrl-C
        try:
            goals: deque[Any] = deque(maxlen=1)
            topic = resolve(namespace.rstrip("/"), goal_topic)
            rospy.Subscriber(topic, find_type("geometry_msgs/Point"), lambda new: goals.append(read_vector(new)))
            env = make_env(
                opened,
                namespace=namespace,
                controller=controller,
                topics={"joint_states": joint_states, "odom": odom, "scan": scan},
                bodies=bodies,
                speed=speed,
                timeout=timeout,
            )
            with contextlib.closing(env):
                print_note(f"sending a command every {env.control_timestep:g} s; press Ctrl-C to stop")
                report = act(
                    env,
                    acting,
                    clock=rospy.get_time,
                    goal=None if goal is None else np.array(goal),
                    goals=goals,
                    seconds=seconds,
                    on_step=Visualization(env, namespace).update,
                )
        finally:
            rospy.signal_shutdown("the policy ended")
    if json:
        print_json({**vars(report), "latency": str(acting.latency)})
    else:
        print_line(f"{report.steps:,} commands, {report.late} of them late; time per action: {acting.latency}")


def _name_and_topic(text: str) -> tuple[str, str]:
    name, separator, topic = text.partition("=")
    if not separator:
        raise typer.BadParameter(f"'{text}' has no '='; write NAME=TOPIC.", param_hint="--body")
    return name, topic

"""A node written with rclpy and control_msgs that sends goals to the actions of a served robot, and reads its frames."""

import json
import sys
import time

import rclpy
from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectoryPoint

rclpy.init()
node = rclpy.create_node("control_types")
states: list[JointState] = []
frames: dict[str, set[str]] = {"/tf": set(), "/tf_static": set()}
node.create_subscription(JointState, "joint_states", states.append, 10)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def store(topic, message):
    frames[topic].update(transform.child_frame_id for transform in message.transforms)


node.create_subscription(TFMessage, "/tf", lambda message: store("/tf", message), 10)
node.create_subscription(TFMessage, "/tf_static", lambda message: store("/tf_static", message), latched)


def wait(condition):
    end = time.monotonic() + 100.0
    while not condition():
        assert time.monotonic() < end
        rclpy.spin_once(node, timeout_sec=0.1)


def ask(kind, name, goal):
    client = ActionClient(node, kind, name)
    assert client.wait_for_server(100.0), name
    accepted = client.send_goal_async(goal)
    wait(accepted.done)
    result = accepted.result().get_result_async()
    wait(result.done)
    return result.result().result


wait(lambda: states and all(frames.values()))
arm = [name for name in states[-1].name if "finger" not in name]
start = dict(zip(states[-1].name, states[-1].position, strict=True))
goal = FollowJointTrajectory.Goal()
goal.trajectory.joint_names = arm
point = JointTrajectoryPoint(positions=[start[name] + 0.1 for name in arm])
point.time_from_start.sec = 2
goal.trajectory.points = [point]
followed = ask(FollowJointTrajectory, "joint_trajectory_controller/follow_joint_trajectory", goal)
now = dict(zip(states[-1].name, states[-1].position, strict=True))
gripper = GripperCommand.Goal()
gripper.command.position = float(sys.argv[1])
closed = ask(GripperCommand, "gripper_controller/gripper_cmd", gripper)
print(json.dumps({
    "error_code": followed.error_code,
    "error": max(abs(now[name] - start[name] - 0.1) for name in arm),
    "reached": closed.reached_goal,
    "frames": {topic: sorted(names) for topic, names in frames.items()},
}))  # fmt: skip
rclpy.shutdown()

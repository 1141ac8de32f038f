"""A node written with rclpy alone: moves an arm, resets the world, and sets a parameter of the server."""

import json
import math
import sys
import time

import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

rclpy.init()
node = rclpy.create_node("plain")
states: list[JointState] = []
texts: list[String] = []
node.create_subscription(JointState, "joint_states", states.append, 10)
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_subscription(String, "robot_description", texts.append, latched)
trajectories = node.create_publisher(JointTrajectory, "joint_trajectory_controller/joint_trajectory", 10)
forward = node.create_publisher(Float64MultiArray, "forward_position_controller/commands", 10)


def wait(condition, seconds=100.0):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        rclpy.spin_once(node, timeout_sec=0.1)
    return True


def call(kind, name, request):
    client = node.create_client(kind, name)
    assert client.wait_for_service(100.0), name
    future = client.call_async(request)
    assert wait(future.done), name
    return future.result()


def error(goal):
    return max(abs(a - b) for a, b in zip(states[-1].position, goal, strict=True))


def stamp():
    return states[-1].header.stamp.sec + 1e-9 * states[-1].header.stamp.nanosec


assert wait(lambda: states and texts), "no joint states"
assert wait(lambda: trajectories.get_subscription_count() and forward.get_subscription_count())
result = {"names": list(states[-1].name), "description": "<robot" in texts[-1].data}
start = list(states[-1].position)
goal = [q + d for q, d in zip(start, [0.4, -0.2, 0.3, 0.5, -0.4, 0.6], strict=True)]

bad = JointTrajectory(joint_names=result["names"], points=[JointTrajectoryPoint(positions=[99.0] * 6)])
trajectories.publish(bad)
forward.publish(Float64MultiArray(data=[math.nan] * 6))
forward.publish(Float64MultiArray(data=[0.1]))
count = len(states)
assert wait(lambda: len(states) > count + 50)
result["moved_by_bad_commands"] = error(start)

point = JointTrajectoryPoint(positions=goal)
point.time_from_start.sec = 2
trajectories.publish(JointTrajectory(joint_names=result["names"], points=[point]))
result["reached"] = wait(lambda: error(goal) < 1e-3)
result["error"] = error(goal)

before = stamp()
answer = call(Trigger, "reset", Trigger.Request())
result["reset"] = answer.success
result["home"] = wait(lambda: error(start) < 0.02)
result["clock_continues"] = stamp() > before

name = sys.argv[1]
values = [Parameter("real_time_factor", value=2.0).to_parameter_msg()]
answer = call(SetParameters, f"/{name}/set_parameters", SetParameters.Request(parameters=values))
result["parameter"] = answer.results[0].successful

call(SetBool, "pause", SetBool.Request(data=True))
wait(lambda: False, 0.5)
before = stamp()
wait(lambda: False, 0.5)
result["paused"] = stamp() == before
print(json.dumps(result))
rclpy.shutdown()

"""Calls every function of MoveGroupCommander and RobotCommander, and tells what they returned."""

import sys
import time

import moveit_commander
import numpy as np
import rospy
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from frobs_rl.common import ros_gazebo
from geometry_msgs.msg import Pose, PoseStamped
from sensor_msgs.msg import JointState
from start import start, tell

start()
moveit_commander.roscpp_initialize(sys.argv)
robot = moveit_commander.RobotCommander()
group = moveit_commander.MoveGroupCommander("manipulator")


def numbers(pose):
    p, q = pose.position, pose.orientation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def refusal(function, *args):
    try:
        function(*args)
    except moveit_commander.MoveItCommanderException as error:
        return str(error)


told = {
    "robot": [
        robot.get_group_names(),
        robot.get_planning_frame(),
        robot.get_root_link(),
        robot.get_joint_names("gripper"),
    ],
    "group": [group.get_name(), group.get_end_effector_link(), group.get_active_joints(), group.get_planning_frame()],
    "attribute": robot.manipulator.get_name(),
    "home": group.get_current_joint_values(),
    "state": robot.get_current_state().joint_state.name,
    "refused": [
        refusal(moveit_commander.MoveGroupCommander, "arms"),
        refusal(group.set_joint_value_target, [9.0, 0, 0, 0, 0, 0]),
        refusal(group.set_joint_value_target, "joint_9", 1.0),
        refusal(group.set_max_velocity_scaling_factor, 1.5),
        refusal(group.set_workspace, [1, 2, 3]),
        refusal(getattr, group, "compute_cartesian_path"),
        refusal(getattr, robot, "get_robot_markers"),
        refusal(getattr, moveit_commander, "MoveGroupInterface"),
        refusal(moveit_commander.MoveGroupCommander, "manipulator", "robot_description", "/elsewhere"),
        refusal(moveit_commander.PlanningSceneInterface, "/elsewhere", True, 0.2),
    ],
    "no target": group.plan()[0],
}

# Joint targets, in every form
moves = []
goal = [0.3, 0.2, -0.2, 0.4, 0.3, -0.5]
for target in (
    (goal,),
    (JointState(name=["joint_1"], position=[-0.3]),),
    ({"joint_2": 0.4, "joint_3": -0.4},),
    ("joint_4", -0.2),
):
    group.set_joint_value_target(*target)
    wanted = group.get_joint_value_target()
    begin = time.monotonic()
    moves.append([group.go(wait=True), wanted, group.get_current_joint_values(), time.monotonic() - begin])
group.set_named_target("ready")
moves.append([group.go(), group.get_joint_value_target(), group.get_current_joint_values(), 0.0])
moves.append([group.go([0.1] * 6), [0.1] * 6, group.get_current_joint_values(), 0.0])
told["moves"] = moves

# Pose targets: where the tool is now, after a motion away from there
here, rpy = group.get_current_pose(), group.get_current_rpy()
told["pose"] = [here.header.frame_id, numbers(here.pose), rpy]
poses = []
for target in (here, here.pose, numbers(here.pose), [*numbers(here.pose)[:3], *rpy]):
    assert group.go([0.0, 0.3, 0.0, 0.0, 0.5, 0.0])
    group.set_pose_target(target)
    poses.append([group.go(), numbers(group.get_current_pose().pose)])
told["poses"] = poses
group.set_position_target([0.3, 0.2, 0.5])
told["position"] = [group.go(), numbers(group.get_current_pose("tool0").pose)[:3]]
in_link = PoseStamped(pose=Pose())
in_link.header.frame_id, in_link.pose.position.z, in_link.pose.orientation.w = "tool0", -0.05, 1.0
before = np.array(numbers(group.get_current_pose().pose)[:3])
group.set_pose_target(in_link)
told["in link"] = [group.go(), float(np.linalg.norm(np.array(numbers(group.get_current_pose().pose)[:3]) - before))]
group.set_position_target([3.0, 0.0, 0.5])
told["far"] = [*group.plan()[:1], group.plan()[3].val, group.go()]
group.clear_pose_targets()
told["cleared"] = group.plan()[0]

# Random values
told["random joints"] = [group.get_random_joint_values() for _ in range(50)]
told["random poses"] = [numbers(group.get_random_pose().pose) for _ in range(5)]

# Plans, scaling and limits
assert group.go([0.0] * 6)
plans = {}
for velocity, acceleration in ((1.0, 1.0), (0.2, 1.0), (0.2, 0.1)):
    group.set_max_velocity_scaling_factor(velocity)
    group.set_max_acceleration_scaling_factor(acceleration)
    success, trajectory, seconds, error = group.plan([1.5, 0.5, -0.5, 1.0, 0.5, 2.0])
    points = trajectory.joint_trajectory.points
    plans[f"{velocity} {acceleration}"] = {
        "success": success,
        "seconds": seconds,
        "error": error.val,
        "joints": trajectory.joint_trajectory.joint_names,
        "duration": points[-1].time_from_start.to_sec(),
        "velocity": np.abs([point.velocities for point in points]).max(axis=0).tolist(),
        "acceleration": np.abs([point.accelerations for point in points]).max(axis=0).tolist(),
    }
told["plans"] = plans
group.set_max_velocity_scaling_factor(0.8)
group.set_max_acceleration_scaling_factor(0.8)
planned = group.plan([0.6, 0.0, 0.0, 0.0, 0.0, 0.0])[1]
told["execute"] = [group.execute(planned, wait=True), group.get_current_joint_values()[0]]
told["stale"] = group.execute(planned, wait=True)  # it starts somewhere else

# Stopping
group.set_max_velocity_scaling_factor(0.1)
sent = group.go([-1.5, 0.0, 0.0, 0.0, 0.0, 0.0], wait=False)
time.sleep(0.3)
group.stop()
stopped = group.get_current_joint_values()[0]
time.sleep(0.3)
told["stop"] = [sent, stopped, group.get_current_joint_values()[0]]

# Settings
group.set_goal_position_tolerance(0.01)
group.set_goal_orientation_tolerance(0.1)
group.set_goal_joint_tolerance(0.002)
tolerances = group.get_goal_tolerance()
group.set_goal_tolerance(0.05)
told["tolerances"] = [tolerances, group.get_goal_tolerance(), group.get_goal_position_tolerance()]
group.set_max_velocity_scaling_factor(1.0)
group.set_position_target([0.3, -0.2, 0.5])
told["loose"] = [group.go(), numbers(group.get_current_pose().pose)[:3]]
group.set_planning_time(0.5)
told["planning time"] = group.get_planning_time()
group.set_workspace([])
group.set_workspace([-1, -1, 0, 1, 1, 2])

# Other groups, and a paused simulation
gripper, everything = robot.get_group("gripper"), robot["everything"]
told["gripper"] = [gripper.get_joints(), gripper.go([0.02]), gripper.get_current_joint_values()]
told["everything"] = [everything.go({"joint_1": 0.2, "finger_joint": 0.03}), robot.get_current_variable_values()]
ros_gazebo.gazebo_pause_physics()
begin = time.monotonic()
told["paused"] = [group.get_current_joint_values(), time.monotonic() - begin]
ros_gazebo.gazebo_unpause_physics()

# Parameters of the execution
reconfigure = rospy.ServiceProxy("/move_group/trajectory_execution/set_parameters", Reconfigure)
answer = reconfigure(Config(doubles=[DoubleParameter("allowed_start_tolerance", 0.0)])).config
told["reconfigured"] = {entry.name: entry.value for entry in (*answer.doubles, *answer.bools)}
told["any start"] = group.execute(planned)
never = [DoubleParameter(f"allowed_{name}", 0.0) for name in ("execution_duration_scaling", "goal_duration_margin")]
reconfigure(Config(doubles=never))
told["too slow"] = group.go([0.0] * 6)
reconfigure(Config(bools=[BoolParameter("execution_duration_monitoring", False)]))
told["not monitored"] = group.go([0.0] * 6)
tell(**told)
moveit_commander.roscpp_shutdown()

"""The parts of the replacement for MoveIt that need no ROS master: SRDF, limits, planning scene, controllers."""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import yaml

from frobs_controllers_planning import ToolGoal
from frobs_core.models import compose, load_model, pose_array
from frobs_core.util.errors import ModelFileError
from frobs_core.util.rotations import rpy_from_quat
from frobs_rl_compat.moveit import poses
from frobs_rl_compat.moveit import scene as scenes
from frobs_rl_compat.moveit.description import RobotDescription, describe
from frobs_rl_compat.moveit.errors import MoveItCommanderException
from frobs_rl_compat.moveit.execution import Execution, choose
from frobs_rl_compat.moveit.group import MoveGroupCommander
from frobs_rl_compat.moveit.joints import JointStates
from frobs_rl_compat.moveit.planning import GroupPlanner
from frobs_rl_compat.moveit.robot import RobotCommander
from frobs_rl_compat.moveit.scene_interface import PlanningSceneInterface
from frobs_rl_compat.moveit.semantics import read_srdf
from frobs_rl_compat.moveit.world import World

CONFIG = Path(__file__).with_name("moveit_package") / "config"
PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "moveit.md"
MODEL = load_model("frobs_robots_abb:models/irb120.urdf.xacro")
SRDF = (
    '<robot name="arm"><group name="manipulator"><chain base_link="base_link" tip_link="tool0"/></group>'
    '<group name="wrist"><joint name="joint_4"/><link name="link_6"/></group>'
    '<group name="both"><group name="wrist"/><joint name="joint_1"/></group>{}</robot>'
)


@pytest.fixture
def messages(legacy_run: list[str]) -> None:
    """Make the message packages importable, or skip where there is no ROS."""


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return describe(MODEL.xml, SRDF.format(""), yaml.safe_load((CONFIG / "joint_limits.yaml").read_text()))


def test_groups_are_read_from_joints_links_chains_and_groups(robot):
    groups = robot.semantics.groups
    assert groups["manipulator"].joint_names == MODEL.joint_names
    assert groups["manipulator"].tip == "tool0"
    assert groups["wrist"].joint_names == ("joint_4", "joint_6")
    assert groups["wrist"].tip == "link_6"
    assert groups["both"].joint_names == ("joint_1", "joint_4", "joint_6")
    assert robot.semantics.planning_frame == "base_link"


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('<group name="a"><joint name="joint_9"/></group>', "joint_9"),
        ('<group name="a"><chain base_link="link_4" tip_link="link_1"/></group>', "do not form a chain"),
        ('<group name="a"><group name="a"/></group>', "contains the group 'a' itself"),
        ('<group name="a"/>', "no joints"),
        ('<virtual_joint name="v" type="floating" parent_frame="map" child_link="base_link"/>', "cannot move"),
    ],
)
def test_an_srdf_that_does_not_fit_is_an_error_that_says_why(text, word):
    with pytest.raises(ModelFileError, match=word):
        read_srdf(SRDF.format(text), MODEL, "srdf")


def test_limits_come_from_joint_limits_yaml_and_then_from_the_urdf(robot):
    velocities = [joint.limits.velocity for joint in robot.model.actuated_joints]
    assert velocities[:2] == [2.0, 4.36332]
    assert robot.max_acceleration == {"joint_1": 4.0}
    assert (robot.velocity_scaling, robot.acceleration_scaling) == (0.5, 0.5)
    assert describe(MODEL.xml, SRDF.format(""), {}).velocity_scaling == 0.1


def test_roll_pitch_and_yaw_are_those_of_the_rotation():
    rng = np.random.default_rng(0)
    for angles in [*rng.uniform(-1.5, 1.5, (50, 3)).tolist(), [0.3, np.pi / 2, 0.0], [0.3, -np.pi / 2, 0.0]]:
        pose = poses.from_list([0.0, 0.0, 0.0, *angles])
        again = poses.from_list([0.0, 0.0, 0.0, *rpy_from_quat(pose[3:])])
        assert abs(pose[3:] @ again[3:]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("numbers", [[0.0] * 5, [0.0] * 3 + [0.5] * 3 + [3.0], [np.nan] * 6])
def test_what_is_no_pose_is_an_error(numbers):
    with pytest.raises(MoveItCommanderException):
        poses.from_list(numbers)


@pytest.mark.ros_feature("gripper commands through MoveIt", "replacement", works=False)
def test_the_default_controller_is_chosen_and_other_types_are_refused():
    entries = [
        {"name": "slow", "type": "FollowJointTrajectory", "joints": ["a", "b"]},
        {"name": "arm", "action_ns": "follow", "type": "FollowJointTrajectory", "default": True, "joints": ["a"]},
        {"name": "hand", "action_ns": "grip", "type": "GripperCommand", "joints": ["c"]},
    ]
    assert choose(["a", "b"], entries, "/move_group") == {"arm/follow": ["a"], "slow": ["b"]}
    with pytest.raises(MoveItCommanderException, match="GripperCommand"):
        choose(["c"], entries, "/move_group")
    with pytest.raises(MoveItCommanderException, match="controller_list is missing"):
        choose(["a"], None, "/move_group")


def test_positions_from_before_the_call_or_the_end_of_a_motion_are_not_current(messages, monkeypatch):
    import rospy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Header

    callbacks = []
    monkeypatch.setattr(rospy, "Subscriber", lambda topic, kind, callback, **_: callbacks.append(callback))
    monkeypatch.setattr(rospy, "get_time", lambda: 10.0)
    states = JointStates("/joint_states")

    def send(*stamps: float) -> None:
        for stamp in stamps:
            time.sleep(0.02)
            header = Header(stamp=rospy.Time.from_sec(stamp))
            callbacks[0](JointState(header=header, name=["a"], position=[stamp]))

    def received(*stamps: float, since: float = 0.0) -> float:
        thread = threading.Thread(target=send, args=stamps)
        thread.start()
        position = states.current(["a"], since=since)["a"]
        thread.join()
        return position

    assert received(9.8, 9.9, 10.0, 10.1) == 10.0
    assert received(10.0, 10.5, 10.6, since=10.5) == 10.5
    assert received(0.0) == 0.0  # the publisher does not stamp its messages
    assert received(9.7) == 9.7  # no message follows: the simulation is paused


def test_a_motion_whose_result_was_lost_ends_with_its_status(messages, monkeypatch):
    import rospy
    from actionlib import CommState
    from actionlib_msgs.msg import GoalStatus

    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    states = SimpleNamespace(stamp=0.0, current=lambda names, since: None)
    execution = Execution("", states)
    for status in (GoalStatus.SUCCEEDED, GoalStatus.ABORTED):
        goal = SimpleNamespace(
            get_comm_state=lambda: CommState.WAITING_FOR_RESULT,
            get_goal_status=lambda status=status: status,
            get_goal_status_text=lambda: "too far",
            get_result=lambda: None,
            comm_state_machine=SimpleNamespace(latest_result=None),
        )
        execution._goals = [goal]
        assert execution._wait(5.0) is (status == GoalStatus.SUCCEEDED)


@pytest.mark.parametrize("owner", [MoveGroupCommander, PlanningSceneInterface, RobotCommander])
def test_the_documentation_lists_exactly_what_is_offered(owner):
    offered = {name for name in dir(owner) if not name.startswith("_")}
    rows = [row for row in PAGE.read_text("utf-8").splitlines() if row.startswith(f"| `{owner.__name__}`")]
    listed = {name for row in rows for name in re.findall(r"`(\w+)`", row)} - {owner.__name__}
    assert listed == offered


def test_joints_outside_the_group_stay(messages, robot):
    from moveit_msgs.msg import PlanningScene

    start = dict(zip(MODEL.joint_names, [0.1, 0.2, -0.3, 0.4, 0.5, 0.6], strict=True))
    group = robot.semantics.groups["wrist"]
    plan = GroupPlanner(robot, group).plan(
        start, np.array([1.0, -1.0]), link="", scene=PlanningScene(),
        velocity_scaling=1.0, acceleration_scaling=1.0, max_seconds=5.0,
    )  # fmt: skip
    assert plan.success
    positions, velocities, _ = plan.trajectory.sample(np.linspace(0.0, plan.trajectory.duration, 50))
    others = [0, 1, 2, 4]
    np.testing.assert_allclose(positions[:, others], np.tile([0.1, 0.2, -0.3, 0.5], (50, 1)), atol=1e-8)
    np.testing.assert_allclose(positions[-1, [3, 5]], [1.0, -1.0], atol=1e-9)
    assert np.abs(velocities[:, others]).max() < 1e-6


def locate(frame: str) -> np.ndarray:
    """Return where the frames "map" and "hand" are."""
    if frame not in ("map", "hand"):
        raise MoveItCommanderException(f"no frame '{frame}'")
    return poses.IDENTITY if frame == "map" else poses.from_list([1.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2])


def test_objects_are_moved_extended_carried_and_put_down(messages):
    from moveit_msgs.msg import AttachedCollisionObject, CollisionObject, PlanningScene
    from shape_msgs.msg import SolidPrimitive

    world = World("arm", "map", locate)

    def change(
        operation: int, frame: str, *numbers: float, edge: float = 0.1, link: str = "", name: str = "box"
    ) -> None:
        item, scene = CollisionObject(id=name, operation=operation), PlanningScene(is_diff=True)
        item.header.frame_id = frame
        item.pose = poses.to_message(poses.from_list([*numbers, 0.0, 0.0, 0.0]))
        if operation in (item.ADD, item.APPEND) and edge:
            item.primitives = [SolidPrimitive(SolidPrimitive.BOX, [edge] * 3)]
        if link:
            scene.robot_state.attached_collision_objects = [AttachedCollisionObject(link_name=link, object=item)]
        else:
            scene.world.collision_objects = [item]
        world.apply(scene)

    def places(name: str = "box") -> list[list[float]]:
        """Return where the shapes of an object are in the world."""
        (found,) = [item for item in world.message().world.collision_objects if item.id == name]
        outer = poses.from_message(found.pose)
        inner = [pose_array(shape.origin) for shape in scenes.collisions(found)]
        return [compose(outer, pose)[:3].round(9).tolist() for pose in inner]

    change(CollisionObject.ADD, "hand", 0.0, 2.0, 0.0)
    assert places() == [[-1.0, 0.0, 0.0]]
    change(CollisionObject.APPEND, "map", 0.0, 0.0, 3.0)
    assert places() == [[-1.0, 0.0, 0.0], [0.0, 0.0, 3.0]]
    change(CollisionObject.MOVE, "hand", 0.0, 3.0, 0.0)
    assert places() == [[-2.0, 0.0, 0.0], [-1.0, 0.0, 3.0]]
    change(CollisionObject.ADD, "map", 0.0, 0.0, 0.0, edge=0.0, link="hand")
    assert world.message().world.collision_objects == []
    change(CollisionObject.REMOVE, "map", 0.0, 0.0, 0.0, link="hand")
    assert places() == [[-2.0, 0.0, 0.0], [-1.0, 0.0, 3.0]]

    for operation, frame, keywords in (
        (CollisionObject.ADD, "nowhere", {}),
        (CollisionObject.MOVE, "map", {"name": "other"}),
        (CollisionObject.ADD, "map", {"edge": -1.0}),
        (CollisionObject.ADD, "map", {"link": "hand", "edge": 0.0, "name": "other"}),
    ):
        with pytest.raises(MoveItCommanderException):
            change(operation, frame, 0.0, 0.0, 0.0, **keywords)
        assert len(places()) == 2
    change(CollisionObject.REMOVE, "map", 0.0, 0.0, 0.0, name="")
    assert world.message().world.collision_objects == []


BOXES = {"left": (0.35, 0.35, 0.25), "right": (0.35, -0.35, 0.25), "front": (0.55, 0.0, 0.1), "above": (0.2, 0.0, 0.95)}
HALF = 0.08
"""[m] half an edge of each box."""


@pytest.mark.slow
@pytest.mark.ros_feature("planning scene of MoveIt", "replacement")
def test_200_planned_motions_touch_nothing_in_mujoco(messages, robot, tmp_path):
    from moveit_msgs.msg import CollisionObject, PlanningScene
    from shape_msgs.msg import SolidPrimitive

    scene, bodies = PlanningScene(), ""
    for name, (x, y, z) in BOXES.items():
        box = CollisionObject(id=name, primitives=[SolidPrimitive(SolidPrimitive.BOX, [2 * HALF] * 3)])
        box.pose.position.x, box.pose.position.y, box.pose.position.z, box.pose.orientation.w = x, y, z, 1.0
        scene.world.collision_objects.append(box)
        bodies += (
            f'<joint name="{name}_" type="fixed"><parent link="base_link"/><child link="{name}"/>'
            f'<origin xyz="{x} {y} {z}"/></joint><link name="{name}"><collision><geometry>'
            f'<box size="{2 * HALF} {2 * HALF} {2 * HALF}"/></geometry></collision></link>'
        )
    # MuJoCo puts what is fixed to the world into the world, so that its boxes do not touch each other or the base.
    model = mujoco.MjModel.from_xml_string(MODEL.xml.replace("</robot>", f"{bodies}</robot>"))
    data = mujoco.MjData(model)
    columns = [model.joint(name).qposadr[0] for name in MODEL.joint_names]

    def contacts(joint_positions: np.ndarray) -> int:
        data.qpos[columns] = joint_positions
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        return int((data.contact.dist[: data.ncon] < 0.0).sum())

    planner = GroupPlanner(robot, robot.semantics.groups["manipulator"])
    rng = np.random.default_rng(0)
    here, done, straight_hits = np.array([0.0, -0.5, 0.3, 0.0, 0.8, 0.0]), 0, 0
    lower, upper = (np.array([getattr(j.limits, side) for j in MODEL.actuated_joints]) for side in ("lower", "upper"))
    limits = [joint.limits.velocity for joint in robot.model.actuated_joints]
    while done < 200:
        target = rng.uniform(lower, upper)
        goal = target if done % 2 else ToolGoal(MODEL.frame_pose("tool0", target[None])[0][0])
        plan = planner.plan(
            dict(zip(MODEL.joint_names, here, strict=True)), goal, link="tool0", scene=scene,
            velocity_scaling=1.0, acceleration_scaling=1.0, max_seconds=5.0,
        )  # fmt: skip
        if not plan.success:
            continue
        positions, velocities, _ = plan.trajectory.sample(np.arange(0.0, plan.trajectory.duration + 0.01, 0.01))
        assert [contacts(row) for row in positions] == [0] * len(positions)
        assert (np.abs(velocities) <= limits).all()
        assert ((positions >= lower - 1e-9) & (positions <= upper + 1e-9)).all()
        line = np.linspace(here, positions[-1], 50)
        straight_hits += any(map(contacts, line))
        here, done = positions[-1], done + 1
    assert straight_hits > 20  # so the boxes are in the way, and MuJoCo sees them

"""Plans among the objects of a planning scene, and tells what came of it."""

import os

import moveit_commander
import numpy as np
import rospy
import rostopic
from geometry_msgs.msg import PoseStamped
from moveit_msgs.msg import CollisionObject, PlanningScene
from shape_msgs.msg import SolidPrimitive
from start import start, tell

start()
group = moveit_commander.MoveGroupCommander("manipulator")
scene = moveit_commander.PlanningSceneInterface(synchronous=True)


def at(x, y, z, frame="map"):
    pose = PoseStamped()
    pose.header.frame_id, pose.pose.orientation.w = frame, 1.0
    pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = x, y, z
    return pose


def plan(target):
    success, trajectory, _, error = group.plan(target)
    points = trajectory.joint_trajectory.points
    bend = 0.0
    if points:
        path = np.array([point.positions for point in points])
        line = path[-1] - path[0]
        share = np.clip((path - path[0]) @ line / (line @ line), 0.0, 1.0)
        bend = float(np.abs(path - path[0] - share[:, None] * line).max())
    return [success, error.val, bend]


LEFT, RIGHT = [0.8, 0.5, 0.2, 0.0, 0.8, 0.0], [-0.8, 0.5, 0.2, 0.0, 0.8, 0.0]
told = {"topic": rostopic.get_topic_type("/planning_scene")[0], "free": plan(RIGHT)}
assert group.go(LEFT)
scene.add_box("wall", at(0.45, 0.0, 0.3), size=(0.5, 0.05, 0.6))
told["wall"] = [plan(RIGHT), group.go(RIGHT), scene.get_known_object_names()]
told["wall pose"] = scene.get_object_poses(["wall"])["wall"].position.x
scene.remove_world_object("wall")
told["removed"] = [plan(LEFT), scene.get_known_object_names()]

# Every shape, at the place of the tool when the joints are LEFT
here = group.get_current_pose().pose.position
spot = at(here.x, -here.y, here.z)
mesh = os.path.join(os.getcwd(), "cube.stl")
corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) - 0.5
faces = [
    (0, 1, 3),
    (0, 3, 2),
    (4, 7, 5),
    (4, 6, 7),
    (0, 5, 1),
    (0, 4, 5),
    (2, 3, 7),
    (2, 7, 6),
    (0, 2, 6),
    (0, 6, 4),
    (1, 7, 3),
    (1, 5, 7),
]
with open(mesh, "w") as file:
    file.write("solid cube\n")
    for face in faces:
        vertices = "".join("vertex {} {} {}\n".format(*corners[i]) for i in face)
        file.write(f"facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    file.write("endsolid cube\n")
shapes = {
    "box": lambda: scene.add_box("thing", spot, (0.1, 0.1, 0.1)),
    "sphere": lambda: scene.add_sphere("thing", spot, 0.05),
    "cylinder": lambda: scene.add_cylinder("thing", spot, 0.1, 0.05),
    "mesh": lambda: scene.add_mesh("thing", spot, mesh, (0.1, 0.1, 0.1)),
}
told["shapes"] = {}
for name, add in shapes.items():
    add()
    told["shapes"][name] = plan(LEFT)[:2]
    scene.remove_world_object()
told["none"] = plan(LEFT)[:2]

# A stick in the hand: attached, it must not hit the table that the hand alone would clear
scene.add_box("table", at(0.0, 0.6, here.z - 0.17), (2.0, 0.8, 0.02))
told["with table"] = plan(LEFT)[:2]
scene.attach_box("tool0", "stick", at(0.0, 0.0, 0.13, "tool0"), (0.02, 0.02, 0.22), touch_links=["finger"])
told["stick"] = [plan(LEFT)[:2], list(scene.get_attached_objects()), scene.get_attached_objects()["stick"].link_name]
scene.remove_attached_object("tool0", "stick")
told["dropped"] = [sorted(scene.get_known_object_names()), scene.get_attached_objects()]
scene.attach_box("tool0", "stick")
told["taken"] = [scene.get_known_object_names(), list(scene.get_attached_objects(["stick"]))]
scene.clear()
told["cleared"] = [scene.get_known_object_names(), scene.get_attached_objects(), plan(LEFT)[:2]]

# Errors, and a change by topic
told["refused"] = []
for function, arguments in (
    (scene.add_box, ("box", at(0, 0, 0, "nowhere"))),
    (scene.add_box, ("box", at(0, 0, 0), (0.1, -0.1, 0.1))),
    (scene.attach_box, ("tool0", "ghost")),
    (getattr, (scene, "add_plane")),
):
    try:
        function(*arguments)
        told["refused"].append(None)
    except moveit_commander.MoveItCommanderException as error:
        told["refused"].append(str(error))
publisher = rospy.Publisher("/planning_scene", PlanningScene, queue_size=1)
while not publisher.get_num_connections():
    rospy.rostime.wallsleep(0.01)
change = PlanningScene(is_diff=True)
box = CollisionObject(id="by topic", operation=CollisionObject.ADD)
box.pose.orientation.w = 1.0

box.primitives = [SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1, 0.1])]
box.pose.position.x = 2.0
change.world.collision_objects = [box]
publisher.publish(change)
for _ in range(200):
    if scene.get_known_object_names():
        break
    rospy.rostime.wallsleep(0.01)
told["by topic"] = scene.get_known_object_names()
tell(**told)

"""What Gazebo makes of each kind of element of a model file: the table that ``frobs doctor robot`` shows."""

from __future__ import annotations

from collections.abc import Mapping

from frobs_core.interfaces import TranslationTable
from frobs_core.models import Treatment

_KEPT, _APPROXIMATED, _DROPPED = Treatment.KEPT, Treatment.APPROXIMATED, Treatment.DROPPED

_BOTH: TranslationTable = {
    "inertias": (_KEPT, ""),
    "moving_joints": (_KEPT, ""),
    "fixed_joints": (_KEPT, "what they hold together is one link, with the mass of all"),
    "other_joints": (_DROPPED, "refused: only revolute, continuous, prismatic and fixed joints can be simulated"),
    "position_limits": (_APPROXIMATED, "ODE's stops: a joint that is pushed goes a little beyond"),
    "velocity_limits": (_DROPPED, "controllers keep to them, the engine does not enforce them"),
    "effort_limits": (_KEPT, "what a drive saturates at"),
    "joint_damping": (_KEPT, "beside the drive's own"),
    "joint_friction": (_APPROXIMATED, "soft: a joint at rest creeps under load"),
    "mimic_joints": (_APPROXIMATED, "they follow, and do not push back on what they follow"),
    "colours": (_DROPPED, "no pictures are drawn"),
    "sensors": (_DROPPED, "declare them in the robot's description"),
    "unknown_elements": (_DROPPED, "not known to the reader"),
}
_URDF: TranslationTable = {
    "visual_shapes": (_DROPPED, "no pictures are drawn"),
    "visual_meshes": (_DROPPED, "no pictures are drawn"),
    "textures": (_DROPPED, "no pictures are drawn"),
    "collision_shapes": (_KEPT, ""),
    "collision_meshes": (_APPROXIMATED, "their convex hulls touch and meet rays"),
    "contact_parameters": (_DROPPED, "friction 1, contacts stiff and without bounce"),
    "safety_controllers": (_DROPPED, "controllers keep to the limits"),
    "calibrations": (_DROPPED, "nothing to calibrate in a simulation"),
    "transmissions": (_DROPPED, "the drives act on the joints directly"),
    "ros2_control": (_DROPPED, "commands come from controllers"),
    "gazebo_tags": (_DROPPED, "the robot is what its links and joints say, on every simulator"),
    "mujoco_tags": (_DROPPED, "MuJoCo's alone"),
}
_MJCF: TranslationTable = {
    "joint_springs": (_DROPPED, "the drives hold the joints"),
    "armatures": (_APPROXIMATED, "inertia of the link that turns; of links that slide dropped"),
    "visual_shapes": (_DROPPED, "only a URDF's shapes are read"),
    "visual_meshes": (_DROPPED, "only a URDF's shapes are read"),
    "collision_shapes": (_DROPPED, "only a URDF's shapes are read: the robot touches nothing"),
    "collision_meshes": (_DROPPED, "only a URDF's shapes are read: the robot touches nothing"),
    "actuators": (_DROPPED, "replaced by the drive of each joint; their force ranges are its limits"),
    "tendons": (_DROPPED, "MuJoCo's alone"),
    "equalities": (_DROPPED, "but for joints that mimic others"),
    "contact_pairs": (_DROPPED, "MuJoCo's alone"),
    "keyframes": (_DROPPED, "say home in the robot's description"),
    "sites": (_DROPPED, "no frames of links"),
    "cameras": (_DROPPED, "pictures are taken by the cameras of the scene"),
    "lights": (_DROPPED, "the scene has its own"),
    "world_geoms": (_DROPPED, "the scene has its own floor"),
    "options": (_DROPPED, "the timestep is the task's, the rest the simulation's"),
}

TABLES: Mapping[str, TranslationTable] = {"urdf": {**_BOTH, **_URDF}, "mjcf": {**_BOTH, **_MJCF}}
"""By format of the model."""

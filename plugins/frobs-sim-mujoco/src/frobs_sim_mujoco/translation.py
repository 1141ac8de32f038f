"""What MuJoCo makes of each kind of element of a model file: the table that ``frobs doctor robot`` shows."""

from __future__ import annotations

from collections.abc import Mapping

from frobs_core.interfaces import TranslationTable
from frobs_core.models import Treatment

_KEPT, _APPROXIMATED, _DROPPED = Treatment.KEPT, Treatment.APPROXIMATED, Treatment.DROPPED

_BOTH: TranslationTable = {
    "inertias": (_KEPT, ""),
    "moving_joints": (_KEPT, ""),
    "fixed_joints": (_KEPT, "a body without joints, so that its frame stays"),
    "other_joints": (_DROPPED, "refused: only revolute, continuous, prismatic and fixed joints can be simulated"),
    "position_limits": (_APPROXIMATED, "soft: a joint that is pushed goes a little beyond"),
    "velocity_limits": (_DROPPED, "controllers keep to them, the engine does not enforce them"),
    "effort_limits": (_KEPT, "the range of the drive"),
    "joint_damping": (_KEPT, "beside the drive's own"),
    "joint_friction": (_APPROXIMATED, "frictionloss: soft, a joint at rest creeps under load"),
    "mimic_joints": (_APPROXIMATED, "a stiff equality: under load the joint lags a little behind"),
    "colours": (_KEPT, ""),
    "sensors": (_DROPPED, "declare them in the robot's description"),
    "unknown_elements": (_DROPPED, "not known to the reader"),
}
_URDF: TranslationTable = {
    "visual_shapes": (_KEPT, "in pictures; the physics goes without"),
    "visual_meshes": (_KEPT, "triangles, in pictures; the physics goes without"),
    "textures": (_DROPPED, "drawn in one colour"),
    "collision_shapes": (_KEPT, ""),
    "collision_meshes": (_APPROXIMATED, "their convex hulls touch; rays meet the triangles"),
    "contact_parameters": (_DROPPED, "MuJoCo's own: friction 1, contacts a little soft"),
    "safety_controllers": (_DROPPED, "controllers keep to the limits"),
    "calibrations": (_DROPPED, "nothing to calibrate in a simulation"),
    "transmissions": (_DROPPED, "the drives act on the joints directly"),
    "ros2_control": (_DROPPED, "commands come from controllers"),
    "gazebo_tags": (_DROPPED, "Gazebo's alone"),
    "mujoco_tags": (_DROPPED, "the options of the simulation hold"),
}
_MJCF: TranslationTable = {
    "visual_shapes": (_KEPT, ""),
    "visual_meshes": (_KEPT, ""),
    "collision_shapes": (_KEPT, ""),
    "collision_meshes": (_APPROXIMATED, "their convex hulls touch, as always in MuJoCo"),
    "joint_springs": (_KEPT, ""),
    "armatures": (_KEPT, "default drive gains leave them out"),
    "actuators": (_DROPPED, "replaced by the drive of each joint; their force ranges are its limits"),
    "tendons": (_KEPT, "those that only touch the robot"),
    "equalities": (_KEPT, ""),
    "contact_pairs": (_KEPT, "those between bodies of the robot"),
    "keyframes": (_DROPPED, "say home in the robot's description"),
    "sites": (_KEPT, ""),
    "cameras": (_DROPPED, "pictures are taken by the cameras of the scene"),
    "lights": (_DROPPED, "the scene has its own in the world; those on bodies stay"),
    "world_geoms": (_DROPPED, "the scene has its own floor"),
    "options": (_DROPPED, "the timestep is the task's; solver and integrator are MuJoCo's defaults and implicitfast"),
}

TABLES: Mapping[str, TranslationTable] = {"urdf": {**_BOTH, **_URDF}, "mjcf": {**_BOTH, **_MJCF}}
"""By format of the model."""

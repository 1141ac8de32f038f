"""The reader of this distribution's formats."""

from __future__ import annotations

from frobs_core.contracts import ModelReader
from frobs_models.bounds import lowest_points
from frobs_models.grippers.describe import describe_gripper, with_gripper
from frobs_models.grippers.finger_links import finger_links
from frobs_models.load import read_model
from frobs_models.meshes.solid import mesh_solid
from frobs_models.mount import attach


class Reader(ModelReader):
    """Reads URDF, xacro and MJCF files, and meshes."""

    read = staticmethod(read_model)
    lowest_points = staticmethod(lowest_points)
    attach = staticmethod(attach)
    finger_links = staticmethod(finger_links)
    describe_gripper = staticmethod(describe_gripper)
    with_gripper = staticmethod(with_gripper)
    solid = staticmethod(mesh_solid)

"""The part of SDF that the bridge supports: models and worlds. Other elements raise an error that names them."""

from frobs_ros.bridge.sdf.model import describe_model, describe_sdf
from frobs_ros.bridge.sdf.world import WorldFile, read_world

__all__ = ["WorldFile", "describe_model", "describe_sdf", "read_world"]

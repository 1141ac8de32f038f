"""Reads SDF models and worlds. Unsupported elements raise an error that contains the element's name."""

from frobs_ros.bridge.sdf.model import describe_model, describe_sdf
from frobs_ros.bridge.sdf.world import WorldFile, read_world

__all__ = ["WorldFile", "describe_model", "describe_sdf", "read_world"]

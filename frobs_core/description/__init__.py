"""Descriptions of robots, scenes, sensors and observation terms, as frozen data."""

from frobs_core.description.bodies import AT_REST, Body, Shape, Twist
from frobs_core.description.camera import Camera, Intrinsics
from frobs_core.description.observation_term import VECTORS, Observation, ObservationTerm
from frobs_core.description.reward_term import Rewards, RewardTerm
from frobs_core.description.robot import ALL, DifferentialDrive, EndEffector, Robot
from frobs_core.description.scene import Attachment, Contact, Marker, Placement, Prop, Scene
from frobs_core.description.sensor import SENSORS, Bumper, ForceTorque, Imu, Lidar, Sensor
from frobs_core.description.translation import Overlap, Translation
from frobs_core.models.defaults import DriveGains

__all__ = [
    "ALL",
    "AT_REST",
    "SENSORS",
    "VECTORS",
    "Attachment",
    "Body",
    "Bumper",
    "Camera",
    "Contact",
    "DifferentialDrive",
    "DriveGains",
    "EndEffector",
    "ForceTorque",
    "Imu",
    "Intrinsics",
    "Lidar",
    "Marker",
    "Observation",
    "ObservationTerm",
    "Overlap",
    "Placement",
    "Prop",
    "RewardTerm",
    "Rewards",
    "Robot",
    "Scene",
    "Sensor",
    "Shape",
    "Translation",
    "Twist",
]

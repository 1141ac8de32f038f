"""RViz configurations for robots that FRobs simulates or controls."""

from importlib.resources import files
from pathlib import Path

ARM = Path(str(files("frobs_ros") / "rviz" / "arm.rviz"))
"""Configuration that shows the robot model, the path of the tool, and markers in the ``base_link`` frame."""

MOBILE = ARM.with_name("mobile.rviz")
"""Configuration that shows the robot model, laser scans, the path of the base, and markers in the ``odom`` frame."""

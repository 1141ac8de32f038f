"""A robot on one sheet: at home, at its limits, and each joint at its own.

poses.py     which joint positions are drawn, and what is written under them
framing.py   where the camera stands so that all of it is seen, and where a point is in the picture
stage.py     the simulator's scene, and the pictures
sheet.py     the sheet
"""

from frobs_devkit.robot_sheet.sheet import draw_robot_sheet

__all__ = ["draw_robot_sheet"]

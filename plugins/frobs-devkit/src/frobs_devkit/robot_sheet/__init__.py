"""Draws a robot in its home position, with all joints at their limits, and with each single joint at its limits.

poses.py     the joint positions to draw, and their captions
stage.py     the scene with the robot, its rendering, and cameras that show the whole robot
sheet.py     the layout of the sheet
"""

from frobs_devkit.robot_sheet.sheet import draw_robot_sheet

__all__ = ["draw_robot_sheet"]

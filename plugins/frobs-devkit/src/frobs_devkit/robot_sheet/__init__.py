"""Draws a robot in its home position, with all joints at their limits, and with each single joint at its limits.

poses.py     the joint positions to draw, and their captions
framing.py   camera poses that show the whole robot, and the projection of points into the image
stage.py     the scene with the robot, and its rendering
sheet.py     the layout of the sheet
"""

from frobs_devkit.robot_sheet.sheet import draw_robot_sheet

__all__ = ["draw_robot_sheet"]

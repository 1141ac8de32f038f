"""An image of a robot at home, at all limits, and with each joint at its limits.

poses.py     the joint positions to draw, and their captions
framing.py   camera poses that show the whole robot, and projection of points into the image
stage.py     the simulator's scene, and rendering
sheet.py     the layout of the sheet
"""

from frobs_devkit.robot_sheet.sheet import draw_robot_sheet

__all__ = ["draw_robot_sheet"]

"""The rods lie along x, and their inertia is that of rods along z: the turn was given to shapes, not to the inertia."""

from __future__ import annotations

from by_outsider.robot.edited import edited

from templates.my_arm import MY_ARM

FAULTY = edited(MY_ARM, ('<origin xyz="${xyz}" rpy="${rpy}"/>\n      <mass', '<origin xyz="${xyz}"/>\n      <mass'))

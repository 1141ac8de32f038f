"""The elbow's limits are in degrees."""

from __future__ import annotations

from by_outsider.robot.edited import edited

from templates.my_arm import MY_ARM

FAULTY = edited(MY_ARM, ('lower="-1.3" upper="1.3"', 'lower="-75" upper="75"'))

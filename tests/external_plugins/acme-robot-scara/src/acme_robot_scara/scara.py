"""The arm, as data."""

from frobs_core.interfaces import DriveGains, Robot

SCARA = Robot(
    model="acme_robot_scara:models/scara.urdf",
    name="scara",
    home={"shoulder": 0.4, "elbow": -0.8},
    tcp="tip",
    gains=DriveGains(stiffness=60.0, damping=6.0),
)
"""Two joints about the vertical, so that gravity does nothing to them."""

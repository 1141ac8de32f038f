{% set robot = robot_file() %}
"""Properties of the robot that its model file does not define. Limits, masses and shapes are read from the file.

All joint arrays list the joints in this order (limits in rad or m):

{% for joint in robot.joints %}
- {{ joint }}
{% endfor %}
"""

from __future__ import annotations

from pathlib import Path

from frobs_core.description import Robot

{{ cookiecutter.name.upper() }} = Robot(
    model=str(Path(__file__).with_name("{{ robot.model_name }}")),
    name="{{ cookiecutter.name }}",
{% if robot.home %}
    home={  # [rad or m] initial joint positions; an omitted joint starts at 0 or at the middle of its limits
{% for joint, position in robot.home.items() %}
        {{ joint | literal }}: {{ position }},
{% endfor %}
    },
{% else %}
    home={},  # [rad or m] initial joint positions; an omitted joint starts at 0 or at the middle of its limits
{% endif %}
    tcp={{ robot.tcp | literal }},  # Tasks use this link as the tool center point.
    # gains=DriveGains(stiffness=…, damping=…),  # by default, each joint is critically damped
)

{% set robot = robot_file() %}
"""The robot: everything that its model file does not contain. Limits, masses and shapes are read from the file.

The joints, in the order of every joint array (limits in rad or m):

{% for joint in robot.joints %}
- {{ joint }}
{% endfor %}
"""

from __future__ import annotations

from pathlib import Path

from frobs_core.interfaces import Robot

{{ cookiecutter.name.upper() }} = Robot(
    model=str(Path(__file__).with_name("{{ robot.model_name }}")),
    name="{{ cookiecutter.name }}",
{% if robot.home %}
    home={  # [rad or m] initial joint positions of an episode; joints you omit are at 0 or the middle of their limits
{% for joint, position in robot.home.items() %}
        {{ joint | literal }}: {{ position }},
{% endfor %}
    },
{% else %}
    home={},  # [rad or m] initial position by joint; by default 0 or the middle of the limits
{% endif %}
    tcp={{ robot.tcp | literal }},  # the tool center point, used by tasks
    # gains=DriveGains(stiffness=…, damping=…): by default, each joint is critically damped for the inertia it moves
)

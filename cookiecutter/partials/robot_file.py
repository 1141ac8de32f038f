{% set robot = robot_file() %}
"""The robot: a description of what its model file does not say. Limits, masses and shapes are read from that file.

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
    home={  # [rad or m] where episodes begin; a joint that is left out rests at 0, or in the middle of its limits
{% for joint, position in robot.home.items() %}
        {{ joint | literal }}: {{ position }},
{% endfor %}
    },
{% else %}
    home={},  # [rad or m] by joint, where episodes begin; what is left out rests at 0, or in the middle of its limits
{% endif %}
    tcp={{ robot.tcp | literal }},  # the link that tasks talk about
    # gains=DriveGains(stiffness=…, damping=…): left out, each joint is critically damped for the inertia that it moves
)

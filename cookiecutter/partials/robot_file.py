{% set robot = robot_file() %}
{% set found = robot.robot %}
{% macro mapping(name, values, indent) %}
{{ " " * indent }}{{ name }}={
{% for key, value in values.items() %}
{{ " " * indent }}    {{ key | literal }}: {{ value | literal }},
{% endfor %}
{{ " " * indent }}},
{%- endmacro %}
"""Properties of the robot that its model file does not define. Limits, masses and shapes are read from the file.

All joint arrays list the joints in this order (limits in rad or m):

{% for joint in robot.joints %}
- {{ joint }}
{% endfor %}
"""

from __future__ import annotations

from pathlib import Path

{% if found.end_effectors %}
from frobs_core.description import DriveGains, EndEffector, Robot
{% else %}
from frobs_core.description import Robot
{% endif %}

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
{% if found.end_effectors %}
{% set tool = found.end_effectors.gripper %}
    # [N·m/rad or N/m, N·m·s/rad or N·s/m] The arm's joints are critically damped; the fingers have the gains that
    # their pads need.
    gains=DriveGains(
{{ mapping("stiffness", found.gains.stiffness, 8) }}
{{ mapping("damping", found.gains.damping, 8) }}
    ),
    self_collision=False,  # the convex parts of coupled fingers overlap while they move
{{ mapping("friction", found.friction, 4) }}
{{ mapping("armature", found.armature, 4) }}
    groups={
{% for group, joints in found.groups.items() %}
{% if joints | length == 1 %}
        {{ group | literal }}: ({{ joints[0] | literal }},),
{% else %}
        {{ group | literal }}: (
{% for joint in joints %}
            {{ joint | literal }},
{% endfor %}
        ),
{% endif %}
{% endfor %}
    },
    default_controllers={"gripper": {{ found.default_controllers.gripper | literal }}},
    end_effectors={
        "gripper": EndEffector(
            tcp={{ tool.tcp | literal }},  # between the pads: z is the direction of approach, fingers close along y
            arm="arm",
            group="gripper",
{{ mapping("open", tool.open, 12) }}
{{ mapping("closed", tool.closed, 12) }}
            gap={{ tool.gap | literal }},  # [m] between the pads of the closed and the open gripper
            has_fixed_jaw={{ tool.has_fixed_jaw | literal }},
        )
    },
{% else %}
    # gains=DriveGains(stiffness=…, damping=…),  # by default, each joint is critically damped
{% endif %}
)

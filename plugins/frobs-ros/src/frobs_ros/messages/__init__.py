"""The message packages that no Debian suite has: gazebo_msgs, controller_manager_msgs, control_msgs, and our frobs_msgs.

``definitions`` contains their definitions, written from the public interfaces. The Python packages are generated into
the user's cache on first use. The checksum of each type proves that it is the one that other ROS nodes use.
"""

from __future__ import annotations

import sys

from frobs_ros.messages.cache import message_folder

__all__ = ["PACKAGES", "message_folder", "use_messages"]

PACKAGES = ("control_msgs", "controller_manager_msgs", "frobs_msgs", "gazebo_msgs")
"""The packages that can be imported after :func:`use_messages`."""


def use_messages() -> None:
    """Append the generated packages to ``sys.path``; packages that ROS itself installs take precedence.

    Calling it twice is harmless. Importing a package requires genpy and std_msgs, so call
    :func:`frobs_ros.environment.use_ros`, which calls this.

    Raises:
        RosNotFoundError: genpy, genmsg or a message package that the definitions refer to is not installed.
        RosError: The packages cannot be stored.
    """
    folder = str(message_folder())
    if folder not in sys.path:
        sys.path.append(folder)

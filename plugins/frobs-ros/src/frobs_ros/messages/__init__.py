"""The message packages that no Debian suite has: gazebo_msgs, controller_manager_msgs, control_msgs, and our frobs_msgs.

``definitions`` holds what they say, written from the public interfaces; ``generated`` the Python that
``tools/generate_messages.py`` made of it. The checksum of each type proves that it is the one that others speak.
"""

from __future__ import annotations

import sys
from pathlib import Path

FOLDER = Path(__file__).parent / "generated"

PACKAGES = ("control_msgs", "controller_manager_msgs", "frobs_msgs", "gazebo_msgs")
"""What can be imported after :func:`use_messages`."""


def use_messages() -> None:
    """Make the packages importable, behind all else: where ROS brings one of its own, that one is imported.

    Calling it twice is harmless. Importing one needs genpy and std_msgs, so call
    :func:`frobs_ros.environment.use_ros`, which calls this.
    """
    if str(FOLDER) not in sys.path:
        sys.path.append(str(FOLDER))

"""The ROS 2 of the tests: the one that is sourced, or the wheels that ``.ci/ros2.sh`` installs in a folder of their own.

The wheels contain packages with the same names as those of ROS 1, so they are not in the virtual environment: only the
processes that tests start see them.
"""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

PREFIX = Path(__file__).parents[1] / "build" / "ros2"
FIRST_DOMAIN = 120
"""ROS_DOMAIN_ID of the first worker of pytest. Domains above 101 do not share ports with each other's participants."""


def ros2_variables() -> dict[str, str] | None:
    """Return the environment variables for processes that use ROS 2, or None if there is no ROS 2.

    Each worker of pytest has a domain of its own.
    """
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    own = {"ROS_DOMAIN_ID": str(FIRST_DOMAIN + number % 80), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    if find_spec("rclpy") is not None and find_spec("rclpy.node") is not None:
        return {**os.environ, **own}
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    packages = PREFIX / "lib" / version / "site-packages"
    if not (packages / "rclpy" / "node.py").is_file():
        return None
    libraries = [str(PREFIX / "lib"), *map(str, sorted(packages.glob("ros_*.libs")))]
    return {
        **os.environ,
        **own,
        "PYTHONPATH": os.pathsep.join([str(packages), *filter(None, [os.environ.get("PYTHONPATH")])]),
        "LD_LIBRARY_PATH": os.pathsep.join([*libraries, *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]),
        "ROS_LOG_DIR": str(PREFIX / "log"),
    }

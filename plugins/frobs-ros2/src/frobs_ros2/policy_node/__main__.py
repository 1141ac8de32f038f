"""Runs a policy bundle: ``python -m frobs_ros2.policy_node BUNDLE``."""

import sys

from frobs_ros2.policy_node.command_line import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

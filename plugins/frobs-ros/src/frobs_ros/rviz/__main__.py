"""Print the path of an RViz configuration, for example for ``rviz -d "$(python -m frobs_ros.rviz arm)"``."""

import argparse

from frobs_ros import rviz


def main() -> None:
    """Print the path of the RViz configuration that the command line selects."""
    parser = argparse.ArgumentParser(prog="python -m frobs_ros.rviz", description=__doc__)
    parser.add_argument("kind", choices=["arm", "mobile"], help="kind of robot that RViz shows")
    print({"arm": rviz.ARM, "mobile": rviz.MOBILE}[parser.parse_args().kind])  # noqa: T201 - its only output


if __name__ == "__main__":
    main()

"""Expand a xacro file like the ROS program ``xacro``, and print the URDF or write it to a file."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

from frobs_core.util.errors import FrobsError
from frobs_rl_compat.ros.ros_urdf import parse_model


def main() -> int:
    """Expand a xacro file, and return the exit code, which is 1 after an error."""
    parser = ArgumentParser(prog="xacro", description=__doc__, allow_abbrev=False)
    parser.add_argument("file", type=Path, help="the xacro file")
    parser.add_argument("arguments", nargs="*", metavar="NAME:=VALUE", help="arguments of the file")
    parser.add_argument("-o", metavar="FILE", type=Path, dest="output", help="output file; default: standard output")
    parser.add_argument(
        "--inorder", "-i", action="store_true", help="no effect, because files are always processed in order"
    )
    options = parser.parse_args()
    try:
        text = parse_model(options.file, options.arguments)
    except FrobsError as error:
        sys.stderr.write(f"error: xacro: {error}\n")
        return 1
    if options.output is None:
        sys.stdout.write(text)
    else:
        options.output.write_text(text, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

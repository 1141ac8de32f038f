"""``python -m frobs_ros.bridge``: the same as ``frobs ros serve``."""

from frobs_ros.cli.serve import main

if __name__ == "__main__":
    main()

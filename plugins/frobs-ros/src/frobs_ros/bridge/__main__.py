"""Entry point of ``python -m frobs_ros.bridge``, which is equivalent to ``frobs ros serve``."""

from frobs_ros.cli.serve import main

if __name__ == "__main__":
    main()

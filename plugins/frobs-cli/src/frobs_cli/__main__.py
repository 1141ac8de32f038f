"""``python -m frobs_cli``: the program without its console script."""

from frobs_cli import main

main()

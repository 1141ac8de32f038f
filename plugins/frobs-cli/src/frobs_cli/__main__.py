"""Runs the ``frobs`` program as ``python -m frobs_cli``, without its console script."""

from frobs_cli import main

main()

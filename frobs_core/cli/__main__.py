"""``python -m frobs_core.cli`` is ``frobs``."""

from frobs_core.cli import main

main()

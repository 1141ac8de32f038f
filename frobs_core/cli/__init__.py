"""The command line: one word per act, each in a file of its own.

Importing this package imports neither typer nor anything heavy; :func:`main` does.
"""


def main() -> None:
    """Run the command line on ``sys.argv`` and exit the process."""
    from frobs_core.cli.app import app

    app(prog_name="frobs")

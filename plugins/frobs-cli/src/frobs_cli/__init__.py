"""The ``frobs`` command, and modules that the commands of other distributions share.

    commands.py   records in which a distribution declares its commands
    program.py    builds the program from these records; imports a command's module when the command runs
    group.py      errors, Ctrl-C and unknown commands
    providers.py  additions of other distributions to ``frobs list`` and ``frobs show``
    output.py, facts.py, formats.py, options.py, model_options.py   for commands of any distribution

This package is separate from :mod:`frobs_core`, because importing the core registers environments, which imports
Gymnasium. Help and shell completion need only the names.
"""

__all__ = ["main"]


def main() -> None:
    """Run the command line on ``sys.argv`` and exit the process."""
    from frobs_cli.program import program

    program()(prog_name="frobs")

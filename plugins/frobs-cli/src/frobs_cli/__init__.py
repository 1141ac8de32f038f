"""The ``frobs`` command, and modules that it shares with the commands of other distributions.

- ``commands.py`` declares a distribution's commands as records.
- ``program.py`` builds the program from these records, and imports a command's module when the command runs.
- ``group.py`` handles errors, Ctrl-C and unknown commands.
- ``providers.py`` lets other distributions extend ``frobs list`` and ``frobs show``.
- ``field_options.py`` turns the fields of dataclasses into options of commands.
- ``lazy_names.py`` imports the public names of a package when they are first used.
- ``output.py``, ``facts.py``, ``formats.py``, ``options.py`` and ``model_options.py`` contain helpers for commands.

This package is separate from :mod:`frobs_core`, because importing the core registers environments, which imports
Gymnasium. Help and shell completion do not need Gymnasium, and start faster without it.
"""

__all__ = ["main"]


def main() -> None:
    """Run the command line on ``sys.argv`` and exit the process."""
    from frobs_cli.program import program

    program()(prog_name="frobs")

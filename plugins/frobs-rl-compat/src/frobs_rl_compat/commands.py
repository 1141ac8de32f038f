"""The commands of this distribution, as strings: nothing is imported to list them."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(name="legacy", summary="Start packages that were written for FRobs_RL, unmodified."),
    Command(
        name="legacy run",
        summary="Run a script or program of an old package.",
        function="frobs_rl_compat.cli.legacy:run",
        passes_options_on=True,
    ),
    Command(
        name="legacy env",
        summary="Print the variables of 'frobs legacy run' as exports for a shell.",
        function="frobs_rl_compat.cli.legacy:env",
    ),
    Command(
        name="migrate",
        summary="Turn a package of FRobs_RL into a plugin.",
        function="frobs_rl_compat.cli.migrate:migrate",
    ),
)

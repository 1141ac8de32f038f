"""The commands of this distribution, as strings: nothing is imported to list them."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(
        name="migrate",
        summary="Turn a package of FRobs_RL into a plugin.",
        function="frobs_rl_compat.cli.migrate:migrate",
    ),
)

"""The distribution's commands, declared as strings so that listing them does not import their modules."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(name="legacy", summary="Run unmodified packages that were written for FRobs_RL."),
    Command(
        name="legacy run",
        summary="Run a script or program from a package that was written for FRobs_RL.",
        function="frobs_rl_compat.cli.legacy:run",
        passes_options_on=True,
    ),
    Command(
        name="legacy env",
        summary="Print the environment variables that 'frobs legacy run' sets, as export commands.",
        function="frobs_rl_compat.cli.legacy:env",
    ),
    Command(
        name="migrate",
        summary="Convert a FRobs_RL package to a plugin.",
        function="frobs_rl_compat.cli.migrate:migrate",
    ),
)

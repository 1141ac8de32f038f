"""Declares the command of this distribution as a string, so that listing the commands does not import it."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(
        name="view",
        summary="Look at an environment, a policy or a robot file in the browser.",
        function="frobs_view.cli.view:view",
        heading="Look around",
    ),
)

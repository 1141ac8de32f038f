"""Declares the commands of this distribution as strings, so that listing the commands does not import them."""

from frobs_cli.commands import Command

COMMANDS: tuple[Command, ...] = (
    Command(
        name="record",
        summary="Record episodes of a policy as a data set.",
        function="frobs_data.cli.record:record",
        heading="Learn",
    ),
    Command(name="data", summary="Check, edit and replay data sets.", heading="Learn"),
    Command(
        name="data replay",
        summary="Repeat recorded episodes, on the same or on another simulator.",
        function="frobs_data.cli.replay:replay",
    ),
)

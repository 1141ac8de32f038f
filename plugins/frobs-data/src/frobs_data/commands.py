"""Declares the commands of this distribution as strings, so that listing the commands does not import them."""

from frobs_cli.commands import Command

_SUMMARIES = {
    "show": "Show the size, the success and the features of a data set.",
    "check": "Read everything in a data set and report what is wrong.",
    "merge": "Combine data sets into a new one.",
    "split": "Divide a data set into several new ones.",
    "export": "Write a data set in another format.",
}

COMMANDS = (
    Command(
        name="record",
        summary="Record episodes of a policy as a data set.",
        function="frobs_data.cli.record:record",
        heading="Learn",
    ),
    Command(name="data", summary="Show, check, edit and replay data sets in the LeRobot format.", heading="Learn"),
    *(
        Command(name=f"data {name}", summary=summary, function=f"frobs_data.cli.data:{name}", heading="Learn")
        for name, summary in _SUMMARIES.items()
    ),
    Command(
        name="data replay",
        summary="Repeat recorded episodes, on the same or on another simulator.",
        function="frobs_data.cli.replay:replay",
        heading="Learn",
    ),
)

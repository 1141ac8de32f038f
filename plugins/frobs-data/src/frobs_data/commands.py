"""Declares the commands of this distribution as strings, so that listing the commands does not import them."""

from frobs_cli.commands import Command

_SUMMARIES = {
    "record": ("record:record", "Record episodes of a policy as a data set."),
    "data": ("", "Show, check, edit and replay data sets in the LeRobot format."),
    "data show": ("data:show", "Show the size, the success and the features of a data set."),
    "data check": ("data:check", "Read everything in a data set and report what is wrong."),
    "data merge": ("data:merge", "Combine data sets into a new one."),
    "data split": ("data:split", "Divide a data set into several new ones."),
    "data export": ("data:export", "Write a data set in another format."),
    "data import": ("bags:import_", "Import ROS bags as episodes of a data set."),
    "data twin": ("twin:twin", "Identify delay, noise and tracking of a recorded robot, for training."),
    "data replay": ("replay:replay", "Repeat recorded episodes, on the same or on another simulator."),
}

COMMANDS = tuple(
    Command(name=name, summary=summary, function=place and f"frobs_data.cli.{place}", heading="Learn")
    for name, (place, summary) in _SUMMARIES.items()
)

"""Commands of this distribution, declared as strings so that listing the commands imports no other modules."""

from typing import Any

from frobs_cli.commands import Command


def _command(name: str, summary: str, **options: Any) -> Command:
    module, function = name.replace(" ", "_"), name.rpartition(" ")[2]
    return Command(name=name, summary=summary, function=f"frobs_devkit.cli.{module}:{function}", **options)


COMMANDS = (
    _command("new", "Create a plugin from templates.", heading="Extend"),
    _command("check", "Check that an environment, a part or a plugin fulfills its contract.", heading="Verify"),
    _command(
        "bench",
        "Measure the time of a step, training run or picture, or how speed scales with parallelism.",
        heading="Verify",
    ),
    _command("parity", "Measure how closely simulators agree on an environment.", heading="Verify"),
    Command(
        name="doctor", summary="Find problems in robot files and plugins, and suggest a fix for each.", heading="Verify"
    ),
    _command("doctor robot", "Examine the model file of a robot."),
    _command(
        "doctor plugins",
        "Import each installed plugin in its own process and report problems.",
        loads_plugins=False,
    ),
)

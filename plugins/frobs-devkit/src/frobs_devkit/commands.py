"""Commands of this distribution, declared as strings so that listing the commands imports no other modules."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(
        name="new",
        summary="Create a plugin from templates.",
        function="frobs_devkit.cli.new:new",
        heading="Extend",
    ),
    Command(
        name="check",
        summary="Check that an environment, a part or a plugin fulfills its contract.",
        function="frobs_devkit.cli.check:check",
        heading="Verify",
    ),
    Command(
        name="bench",
        summary="Measure the time of a step, training run or picture, or how speed scales with parallelism.",
        function="frobs_devkit.cli.bench:bench",
        heading="Verify",
    ),
    Command(
        name="parity",
        summary="Measure how closely simulators agree on an environment.",
        function="frobs_devkit.cli.parity:parity",
        heading="Verify",
    ),
    Command(
        name="doctor",
        summary="Find problems in robot files and plugins, and suggest a fix for each.",
        heading="Verify",
    ),
    Command(
        name="doctor robot",
        summary="Examine the model file of a robot.",
        function="frobs_devkit.cli.doctor_robot:robot",
    ),
    Command(
        name="doctor plugins",
        summary="Import each installed plugin in its own process and report problems.",
        function="frobs_devkit.cli.doctor_plugins:plugins",
        loads_plugins=False,
    ),
)

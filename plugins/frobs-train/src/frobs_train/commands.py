"""The commands of this distribution, as strings: nothing is imported to list them."""

from frobs_cli.commands import Command

COMMANDS = (
    Command(
        name="train",
        summary="Train a policy and write a run folder.",
        function="frobs_train.cli.train:train",
        heading="Learn",
    ),
    Command(
        name="resume",
        summary="Continue a training run from its newest checkpoint.",
        function="frobs_train.cli.resume:resume",
        heading="Learn",
    ),
    Command(
        name="evaluate",
        summary="Measure the success of a policy on new episodes.",
        function="frobs_train.cli.evaluate:evaluate",
        heading="Learn",
    ),
    Command(
        name="play",
        summary="Watch a policy in a window, or record a video.",
        function="frobs_train.cli.play:play",
        heading="Learn",
    ),
    Command(
        name="plot",
        summary="Plot learning curves of one or several runs.",
        function="frobs_train.cli.plot:plot",
        heading="Learn",
    ),
    Command(
        name="export",
        summary="Write a policy as one file for deployment.",
        function="frobs_train.cli.export:export",
        heading="Learn",
    ),
    Command(
        name="compare",
        summary="Compare runs over their seeds, with confidence intervals.",
        function="frobs_train.cli.compare:compare",
        heading="Learn",
    ),
    Command(
        name="tune",
        summary="Search for better training settings.",
        function="frobs_train.cli.tune:tune",
        heading="Learn",
    ),
)

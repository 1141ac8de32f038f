"""Commands of this distribution, stored as strings so that listing the commands imports no other modules."""

from frobs_cli.commands import Command

_SUMMARIES = {
    "train": "Train a policy and write a run folder.",
    "resume": "Continue a training run from its newest checkpoint.",
    "evaluate": "Measure the success of a policy on new episodes.",
    "play": "Watch a policy in a window, or record a video.",
    "plot": "Plot learning curves of one or several runs.",
    "export": "Write a policy to a single file for deployment.",
    "compare": "Compare runs across seeds, with confidence intervals.",
    "study": "Train and evaluate environments × algorithms × seeds, and write one page.",
    "tune": "Search for better training settings.",
}

COMMANDS = tuple(
    Command(name=name, summary=summary, function=f"frobs_train.cli.{name}:{name}", heading="Learn")
    for name, summary in _SUMMARIES.items()
)

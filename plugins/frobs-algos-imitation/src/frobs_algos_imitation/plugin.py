"""Records of this distribution."""

from collections.abc import Mapping, Sequence

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord

_ARMS = ("Panda", "Ur5")
_DAGGER = {
    "dagger_peg.yaml": ("PegInsertion",),
    "dagger_peg_tight.yaml": ("PegInsertionTight",),
    "dagger.yaml": (*("Lift", "OpenDoor", "OpenDrawer", "PickAndPlace", "PickAndPlaceGoal", "Slide", "SlideGoal"),),
    "dagger_long.yaml": ("Stack", "Push", "PushGoal"),
}
"""Tasks with an expert, by the file of their tuned settings."""

_ANY_ARM = {f"frobs/{task}-v0": "dagger_any_arm.yaml" for task in ("PickAndPlace", "Push", "Lift", "Stack")}
"""File of the tuned settings of environments without a fixed robot."""

_SEEING = {
    "frobs/PandaPickAndPlaceVision-v0": "dagger_vision.yaml",
    "frobs/PandaOpenDrawerVision-v0": "dagger_vision.yaml",
    "frobs/PandaPushVision-v0": "dagger_vision_push.yaml",
    "frobs/PandaStackVision-v0": "dagger_vision_long.yaml",
}
"""File of the tuned settings of environments with cameras."""


def _record(
    name: str, cls: str, summary: str, tuned: Mapping[str, Sequence[str]], others: Mapping[str, str] | None = None
) -> AlgorithmRecord:
    files = {f"frobs/{arm}{task}-v0": file for file, tasks in tuned.items() for task in tasks for arm in _ARMS}
    files |= others or {}
    return AlgorithmRecord(
        name=name,
        summary=summary,
        entry_point=f"frobs_algos_imitation.{name}:{cls}",
        install_hint="pip install frobs-algos-imitation",
        tuned={id: f"frobs_algos_imitation:tuned/{file}" for id, file in files.items()},
        search_space=f"frobs_algos_imitation:search/{name}.yaml",
    )


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Return the records of the algorithms."""
    every = tuple(task for tasks in _DAGGER.values() for task in tasks)
    return [
        _record("bc", "BC", "behavior cloning of a data set or an expert", {"bc.yaml": every}),
        _record(
            "dagger",
            "Dagger",
            "behavior cloning of an expert in the states that the learner visits",
            _DAGGER,
            _ANY_ARM | _SEEING,
        ),
        _record("act", "ACT", "action chunking with a transformer", {"act.yaml": every}),
    ]

"""Records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord

_ARMS = ("Panda", "Ur5")
_DAGGER = {
    "dagger_peg.yaml": ("PegInsertion",),
    "dagger_peg_tight.yaml": ("PegInsertionTight",),
    "dagger.yaml": (
        *("Lift", "OpenDoor", "OpenDrawer", "PickAndPlace", "PickAndPlaceGoal", "PushGoal", "Slide", "SlideGoal"),
    ),
    "dagger_long.yaml": ("Push", "Stack"),
}
"""Tasks with an expert, by the file of their tuned settings."""


def _record(name: str, cls: str, summary: str, **tuned: tuple[str, ...]) -> AlgorithmRecord:
    files = {f"frobs/{arm}{task}-v0": file for file, tasks in tuned.items() for task in tasks for arm in _ARMS}
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
        _record("bc", "BC", "behavior cloning of a data set or an expert", **{"bc.yaml": every}),
        _record("dagger", "Dagger", "behavior cloning of an expert in the states that the learner visits", **_DAGGER),
        _record("act", "ACT", "action chunking with a transformer", **{"act.yaml": every}),
    ]

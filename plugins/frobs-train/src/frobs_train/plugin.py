"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import PolicyRecord


@hookimpl
def frobs_extensions() -> list[PolicyRecord]:
    """Return the records of the policies."""
    return [
        PolicyRecord(
            name="pretrained",
            summary="the trained policy that comes with the environment ID",
            entry_point="frobs_train.runs.policy:PretrainedPolicy",
            install_hint="pip install frobs-train",
        ),
        PolicyRecord(
            name="trained",
            summary="run folders of 'frobs train', bundles of 'frobs export', and model files of other libraries",
            entry_point="frobs_train.runs.policy:TrainedPolicy",
            install_hint="pip install frobs-train",
            suffixes=("/", ""),
        ),
    ]

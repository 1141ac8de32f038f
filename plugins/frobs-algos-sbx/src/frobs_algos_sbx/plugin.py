"""Records of this distribution."""

from dataclasses import replace

from frobs_algos_sb3 import plugin as torch_family
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import AlgorithmRecord

_CLASSES = {
    "ppo": "ppo:SbxPPO",
    "sac": "off_policy:SbxSAC",
    "td3": "off_policy:SbxTD3",
    "tqc": "off_policy:SbxTQC",
    "crossq": "off_policy:SbxCrossQ",
    "dqn": "off_policy:SbxDQN",
}
"""Module and class of each algorithm, by the name of the equivalent PyTorch algorithm."""


@hookimpl
def frobs_algorithms() -> list[AlgorithmRecord]:
    """Return the records of sbx's algorithms, with the tuned settings and search spaces of the PyTorch algorithms."""
    return [
        replace(
            record,
            name=f"sbx_{record.name}",
            summary=f"{record.summary.removesuffix(', from sb3-contrib')}, in JAX",
            entry_point=f"frobs_algos_sbx.{_CLASSES[record.name]}",
            install_hint="pip install frobs-algos-sbx",
            model_files={},
        )
        for record in torch_family.frobs_algorithms()
        if record.name in _CLASSES
    ]

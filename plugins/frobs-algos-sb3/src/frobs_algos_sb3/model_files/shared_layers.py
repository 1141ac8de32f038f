"""Copies the layers that the actor and the critic share in model files written by stable-baselines3 before 1.8.

Copying the layers does not change predictions. During further training, the two copies diverge.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import torch as th

from frobs_algos_sb3.model_files.archive import ModelArchive

_SHARED = "mlp_extractor.shared_net."
_SIDES = {"pi": "mlp_extractor.policy_net.", "vf": "mlp_extractor.value_net."}
_LAYER = re.compile(r"^mlp_extractor\.(shared|policy|value)_net\.\d{1,3}\.(weight|bias)$")


def copy_shared_layers(archive: ModelArchive) -> ModelArchive:
    """Return ``archive`` if its actor and critic do not share layers, or else a copy with separate layers."""
    policy, kwargs = archive.tensors.get("policy"), archive.data.get("policy_kwargs")
    if not isinstance(policy, Mapping) or not isinstance(kwargs, dict):
        return archive
    inner = [name for name in policy if str(name).startswith("mlp_extractor.")]
    if not any(name.startswith(_SHARED) for name in inner) or not all(map(_LAYER.match, inner)):
        return archive
    sources = _sources(list(policy))
    tensors = dict(archive.tensors)
    tensors["policy"] = {name: policy[old] for name, old in sources.items()}
    if "policy.optimizer" in tensors:
        tensors["policy.optimizer"] = _optimizer(tensors["policy.optimizer"], list(policy), list(sources.values()))
    widths = {
        side: [len(tensors["policy"][name]) for name in sources if name.startswith(prefix) and name.endswith("weight")]
        for side, prefix in _SIDES.items()
    }
    data = {**archive.data, "policy_kwargs": {**kwargs, "net_arch": widths}}
    return replace(archive, data=data, tensors=tensors, content=_content(archive, tensors))


def _sources(names: list[str]) -> dict[str, str]:
    """Return a mapping from new to old tensor names, in the order of the new policy's parameters."""
    shared = [name for name in names if name.startswith(_SHARED)]
    depth = 2 * len([name for name in shared if name.endswith("weight")])  # an activation follows each layer
    sources: dict[str, str] = {}
    for name in names:
        if not name.startswith("mlp_extractor."):
            sources[name] = name
        elif name == shared[0]:
            for side in _SIDES.values():
                sources |= {side + each.removeprefix(_SHARED): each for each in shared}
                for own in (each for each in names if each.startswith(side)):
                    number, _, kind = own.removeprefix(side).partition(".")
                    sources[f"{side}{int(number) + depth}.{kind}"] = own
    return sources


def _optimizer(state: Any, old: list[str], sources: Iterable[str]) -> Any:
    """Return an optimizer's state for the new parameters, each of which corresponds to an old parameter."""
    if not isinstance(state, dict) or len(state.get("param_groups", ())) != 1:
        return state
    group = state["param_groups"][0]
    numbers = [old.index(name) for name in sources]
    known = state.get("state", {}) if len(group["params"]) == len(old) else {}
    return {
        "state": {new: known[number] for new, number in enumerate(numbers) if number in known},
        "param_groups": [{**group, "params": list(range(len(numbers)))}],
    }


def _content(archive: ModelArchive, tensors: Mapping[str, Any]) -> bytes:
    """Return the content of the model file, with the tensors of the policy and its optimizer replaced."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(archive.content)) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            part = name.removesuffix(".pth")
            if name.endswith(".pth") and part in ("policy", "policy.optimizer"):
                with new.open(name, "w") as file:
                    th.save(tensors[part], file)
            else:
                new.writestr(name, old.read(name))
    return target.getvalue()

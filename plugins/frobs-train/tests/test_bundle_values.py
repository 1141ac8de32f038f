"""Every value of a bundle's description may have any type, and is reported if it has the wrong one."""

from __future__ import annotations

import contextlib
import copy
from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import FrobsError
from frobs_deploy import DeployError, Policy
from frobs_deploy.bundle import Bundle
from frobs_train.export.bundle_run import BundleRun
from frobs_train.export.pretrained import read_pretrained

WRONG: list[Any] = [None, [], {}, "x", -1, 1.5, 10**400, 1e999, True, [[]], {"a": {}}, "\ud800", [None, "x"]]


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the keys of every value of a description, but only two items of each list."""
    items = value.items() if isinstance(value, dict) else enumerate(value[:2]) if isinstance(value, list) else ()
    return [path, *(place for key, item in items for place in places(item, (*path, key)))]


@pytest.mark.slow
@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: repr(wrong)[:20])
def test_a_description_with_a_wrong_value_is_reported(tmp_path: Path, wrong: Any) -> None:
    original = read_pretrained("frobs/Irb120Reach-v0")
    manifest = {key: value for key, value in original.manifest.items() if key not in ("format", "files")}
    for path in places(manifest)[1:]:
        changed = copy.deepcopy(manifest)
        parent: Any = changed
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] = wrong
        bundle = Bundle(tmp_path / "p.frobs", changed, original.graph, "")
        with contextlib.suppress(FrobsError, DeployError):
            Policy(BundleRun(bundle).bundle).bench(1)

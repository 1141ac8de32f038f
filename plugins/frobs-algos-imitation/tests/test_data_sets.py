"""Learning from recorded data sets, FRobs's own and those of others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_algos_imitation.samples import Samples
from frobs_core.util.errors import ConfigurationError, FrobsError
from frobs_train import resolve_config, train

frobs_data = pytest.importorskip("frobs_data")

LIFT = "frobs/PandaLift-v0"


@pytest.fixture(scope="module", name="folder")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "lift"
    frobs_data.record(LIFT, "expert", episodes=2, out=folder)
    return folder


def clone(folder: Path, run: Path, *settings: str) -> Samples:
    sources = [f"algorithm_config.demonstrations={folder}", "steps=3", "num_envs=1"]
    config = resolve_config(LIFT, flags={"algorithm": "bc", "seed": 0}, settings=[*sources, *settings])
    return Samples.read(train(config, run).newest_checkpoint()[0].path / "algorithm" / "samples")


def test_a_recording_is_learned_as_it_was_observed(folder: Path, tmp_path: Path) -> None:
    samples = clone(folder, tmp_path / "run", "algorithm_config.history=2")
    data = frobs_data.Dataset(folder)
    state = data.columns(["observation.state"])["observation.state"]
    assert np.isin(state, samples.frames.numpy()).all()
    np.testing.assert_array_equal(data.columns(["action"])["action"], samples.labels.numpy())
    assert np.flatnonzero(samples.parts[0]["episode_start"]).tolist() == [0, 75]


def test_a_data_set_of_others_is_learned_with_a_mapping(folder: Path, tmp_path: Path) -> None:
    """The elements have other names, as in a data set that another program recorded."""
    other = tmp_path / "other"
    frobs_data.merge([folder], other)
    info: dict[str, Any] = json.loads((other / "meta/info.json").read_text("utf-8"))
    terms: dict[str, dict[str, Any]] = {}
    for feature in ("observation.state", "observation.environment_state"):
        for column, name in enumerate(info["features"][feature]["names"]):
            term = name.rpartition("_")[0] if name[-1].isdigit() else name
            terms.setdefault(term, {"feature": feature, "columns": []})["columns"].append(column)
        info["features"][feature]["names"] = [f"x{i}" for i in range(info["features"][feature]["shape"][0])]
    (other / "meta/info.json").write_text(json.dumps(info), "utf-8")
    with pytest.raises(FrobsError, match="mapping"):
        clone(other, tmp_path / "without")
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(json.dumps({"action": "action", "observation": terms}), "utf-8")
    theirs = clone(other, tmp_path / "with", f"algorithm_config.demonstration_mapping={mapping}")
    np.testing.assert_array_equal(theirs.frames.numpy(), clone(folder, tmp_path / "own").frames.numpy())


def test_a_mapping_needs_a_data_set(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="omit the mapping"):
        clone(Path("expert"), tmp_path / "run", "algorithm_config.demonstration_mapping=m.yaml")


def test_data_of_another_environment_is_refused(folder: Path, tmp_path: Path) -> None:
    settings = [f"algorithm_config.demonstrations={folder}", "steps=3", "num_envs=1"]
    config = resolve_config("frobs/PandaStack-v0", flags={"algorithm": "bc", "seed": 0}, settings=settings)
    with pytest.raises(FrobsError, match="lift"):
        train(config, tmp_path / "run")

"""Learning from recorded data sets, FRobs's own and those of others."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th

from frobs_algos_imitation.algorithm import ImitationAlgorithm
from frobs_algos_imitation.samples import Samples
from frobs_core import load_policy, plugins
from frobs_core.contracts import Operator, Pacer
from frobs_core.plugins.records import PolicyRecord
from frobs_core.util.errors import ConfigurationError, FrobsError
from frobs_train import Run, resolve_config, resume, train

frobs_data = pytest.importorskip("frobs_data")

LIFT = "frobs/PandaLift-v0"
LENGTH = 75
"""Steps of an episode."""


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


class Hand(Operator):
    """The expert in the place of a person, who takes over from step 20 to step 49 of each episode."""

    def bind(self, env: Any) -> None:
        self.expert = load_policy("expert", env)
        self.looks, self.step = 0, -1

    def act(self, observation: Any, episode_start: Any) -> Any:
        return self.expert.act(observation, episode_start)

    @property
    def is_moving(self) -> bool:
        self.step += 1
        return 20 <= self.step % LENGTH < 50

    def offer(self, commands: Any) -> None:
        """Do nothing."""

    def command(self) -> str:
        self.looks += 1
        return ("start", *[""] * LENGTH, "keep")[(self.looks - 1) % (LENGTH + 2)]

    def show(self, text: str) -> None:
        """Do nothing."""


@pytest.fixture(scope="module")
def corrected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set in which a person corrects random actions."""
    out = tmp_path_factory.mktemp("corrections") / "lift"
    hand = PolicyRecord(name="hand", summary="", entry_point=f"{__name__}:Hand")
    found = plugins.get_record
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plugins, "get_record", lambda kind, name: hand if name == "hand" else found(kind, name))
        patch.setattr(Pacer, "wait", lambda self, duration: None)
        frobs_data.record(LIFT, "random", episodes=2, out=out, takeover="hand")
    return out


def imitated(run: Run) -> Samples:
    return Samples.read(run.newest_checkpoint()[0].path / "algorithm" / "samples")


@pytest.mark.parametrize("history", [1, 3])
def test_dagger_imitates_the_steps_of_the_person(folder: Path, corrected: Path, tmp_path: Path, history: int) -> None:
    sources = [f"algorithm_config.expert=[{folder}, {corrected}]", f"algorithm_config.history={history}"]
    flags = {"algorithm": "dagger", "seed": 0, "num_envs": 1, "steps": 3}
    samples = imitated(train(resolve_config(LIFT, flags=flags, settings=sources), tmp_path / "run"))
    columns = frobs_data.Dataset(corrected).columns(["intervention", "action"])
    taken = columns["intervention"]
    assert taken.reshape(2, LENGTH).sum(axis=1).tolist() == [30, 30]
    # All steps of the demonstrations, and only those of the person in the corrections.
    demonstrated = 2 * LENGTH
    np.testing.assert_array_equal(samples.rows.numpy(), [*range(demonstrated), *demonstrated + np.flatnonzero(taken)])
    np.testing.assert_array_equal(samples.labels.numpy()[demonstrated:], columns["action"])
    if history > 1:  # the memory of the learner contains what was really done
        previous = samples.frames.numpy()[demonstrated + 21, -columns["action"].shape[1] :]
        np.testing.assert_array_equal(previous, columns["action"][20])
    drawn, trained = [], ImitationAlgorithm._update

    def update(self: Any, progress: float) -> float:
        kept = self.samples.batch
        self.samples.batch = lambda indices, *rest: drawn.append(indices) or kept(indices, *rest)
        try:
            return trained(self, progress)
        finally:
            self.samples.batch = kept

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ImitationAlgorithm, "_update", update)
        train(resolve_config(LIFT, flags=flags, settings=sources), tmp_path / "again")
    assert np.isin(np.concatenate(drawn), samples.rows.numpy()).all()
    assert (np.concatenate(drawn) >= demonstrated).any()


def test_chunks_end_where_the_person_hands_back(corrected: Path, tmp_path: Path) -> None:
    settings = [f"algorithm_config.demonstrations={corrected}", "algorithm_config.chunk=4"]
    config = resolve_config(LIFT, flags={"algorithm": "act", "seed": 0, "num_envs": 1, "steps": 2}, settings=settings)
    samples = imitated(train(config, tmp_path / "run"))
    valid = samples.batch(th.tensor([20, 47, 48, 49]), 1, 4)[2]
    assert valid.tolist() == [[True] * 4, [True] * 3 + [False], [True] * 2 + [False] * 2, [True] + [False] * 3]


def test_a_run_of_corrections_can_be_resumed_without_them(corrected: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(corrected, tmp_path / "copy"))
    settings = [f"algorithm_config.expert=[{copy}]"]
    flags = {"algorithm": "dagger", "seed": 0, "num_envs": 1, "steps": 4}
    run = train(resolve_config(LIFT, flags=flags, settings=settings), tmp_path / "run")
    shutil.rmtree(copy)
    assert len(imitated(resume(run.path, steps=8)).rows) == 60


def test_a_data_set_without_a_step_of_the_person_is_an_error(corrected: Path, tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    copy = Path(shutil.copytree(corrected, tmp_path / "copy"))
    for path in (copy / "data").rglob("*.parquet"):
        table = pq.read_table(path)
        column = table.schema.get_field_index("intervention")
        never = pa.array([False] * len(table), table.schema.field(column).type)
        pq.write_table(table.set_column(column, table.schema.field(column), never), path)
    flags = {"algorithm": "dagger", "seed": 0, "num_envs": 1, "steps": 3}
    (tmp_path / "trained").mkdir()
    (tmp_path / "trained" / "config.yaml").touch()
    others = [(each, "not the folder of a data set") for each in ("expert", tmp_path / "trained")]
    for source, message in [(copy, "no step in which a person acted"), *others]:
        config = resolve_config(LIFT, flags=flags, settings=[f"algorithm_config.expert=[{source}]"])
        with pytest.raises(FrobsError, match=message):
            train(config, tmp_path / "run")


def test_a_folder_of_corrections_may_be_named_like_a_policy(
    corrected: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(corrected.parent)
    flags = {"algorithm": "dagger", "seed": 0, "num_envs": 1, "steps": 2}
    config = resolve_config(LIFT, flags=flags, settings=["algorithm_config.expert=[lift]"])
    assert len(imitated(train(config, tmp_path / "run")).rows) == 60


def test_the_memory_of_a_policy_contains_the_action_of_the_person(folder: Path, tmp_path: Path) -> None:
    settings = [f"algorithm_config.demonstrations={folder}", "algorithm_config.history=2"]
    config = resolve_config(LIFT, flags={"algorithm": "bc", "seed": 0, "num_envs": 1, "steps": 2}, settings=settings)
    run = train(config, tmp_path / "run")
    env = gym.make_vec(f"frobs_core:{LIFT}", num_envs=1)
    policy, other = (load_policy(run.path, env) for _ in range(2))
    seen, start = env.reset(seed=0)[0], np.ones(1, bool)
    own = policy.act(seen, start)
    other.act(seen, start)
    policy.remember(own)
    other.remember(np.full(own.shape, 0.7))
    size = own.shape[1]
    for each, expected in ((policy, own), (other, np.full(own.shape, 0.7, np.float32))):
        each.act(seen, ~start)
        window = each._policy._state[0]  # type: ignore[attr-defined]
        np.testing.assert_array_equal(window[:, -1, -size:], expected)
    env.close()

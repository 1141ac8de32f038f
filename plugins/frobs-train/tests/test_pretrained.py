"""The trained policies that come with IDs: finding them, and what is wrong with those that cannot be used."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from frobs_core.plugins import registry
from frobs_core.util.errors import PluginError, RunError, UnknownNameError
from frobs_deploy import pack_bundle, read_bundle
from frobs_deploy.errors import BundleError, BundleMismatchError
from frobs_train import evaluate, open_pretrained
from frobs_train.environments import make_env
from frobs_train.export.bundle_run import changes_since
from frobs_train.export.pretrained import (
    claimed_evaluation,
    describe_pretrained,
    read_pretrained,
)

REACH = "frobs/Irb120Reach-v0"
DYNAMIC = "frobs/Irb120ReachDynamic-v0"
Ship = Callable[[str, str], None]


@pytest.fixture
def ship(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Ship:
    """Let an ID come with another file, of the package ``acme_policies`` or another."""
    package = tmp_path / "acme_policies"
    package.mkdir()
    (package / "__init__.py").write_text("raise ImportError('to find a file, nothing is imported')\n")
    shutil.copyfile(registry.pretrained_path(REACH), package / "reach.frobs")
    monkeypatch.syspath_prepend(tmp_path)
    known = dict(registry.environments())

    def change(id: str, pretrained: str) -> None:
        task, record = known[id]
        changed = {**known, id: (task, replace(record, pretrained=pretrained))}
        monkeypatch.setattr(registry, "environments", lambda: changed)

    return change


def test_a_trained_policy_is_evaluated_as_a_run_is(tmp_path: Path) -> None:
    run = open_pretrained(f"frobs_core:{REACH}")
    data = run.path.read_bytes()
    found = evaluate(run, 16, seed=5)
    assert found.success_rate is not None
    assert found.success_rate >= 0.8
    assert found.steps == run.steps
    assert run.path.read_bytes() == data


def test_it_lies_in_a_package_that_is_not_imported_for_it(ship: Ship) -> None:
    ship(REACH, "acme_policies:reach.frobs")
    assert read_pretrained(REACH).path.parent.name == "acme_policies"


def test_an_id_without_one_names_those_that_have_one(ship: Ship) -> None:
    ship(DYNAMIC, "")
    with pytest.raises(RunError, match=r"frobs/Irb120ReachDynamic-v0 has no trained policy.*IDs with one: .*") as error:
        open_pretrained(DYNAMIC)
    assert REACH in str(error.value)
    assert "frobs train frobs/Irb120ReachDynamic-v0" in str(error.value)
    with pytest.raises(RunError, match="CartPole-v1 has no trained policy"):
        open_pretrained("CartPole-v1")
    with pytest.raises(UnknownNameError, match="Irb120Reach-v0"):
        open_pretrained("frobs/Irb120Raech-v0")


@pytest.mark.parametrize(
    ("pretrained", "reason"),
    [
        ("acme_policies:missing.frobs", "cannot be read"),
        ("acme_absent:reach.frobs", "not a file in an installed package"),
        ("reach.frobs", "not a file in an installed package"),
        ("acme_policies:__init__.py", "not a policy bundle"),
    ],
)
def test_a_file_that_cannot_be_used_is_named(ship: Ship, pretrained: str, reason: str) -> None:
    ship(REACH, pretrained)
    with pytest.raises((BundleError, PluginError), match=reason):
        open_pretrained(REACH)


def test_a_policy_of_another_id_is_refused(ship: Ship) -> None:
    ship(DYNAMIC, "acme_policies:reach.frobs")
    with pytest.raises(BundleError, match=f"was trained in {REACH}, so it is not a policy for {DYNAMIC}"):
        open_pretrained(DYNAMIC)


def test_a_policy_whose_spaces_are_no_longer_those_of_the_id_is_refused() -> None:
    run = open_pretrained(REACH)
    env = make_env(REACH, {})
    dynamic = make_env(DYNAMIC, {})
    with pytest.raises(BundleMismatchError, match="observation space differs"):
        run.policy(dynamic.observation_space, env.action_space)
    env.close()
    dynamic.close()


def test_what_has_changed_since_is_told_line_by_line(tmp_path: Path) -> None:
    run = open_pretrained(REACH)
    assert changes_since(run) == []
    manifest = {key: value for key, value in run.bundle.manifest.items() if key not in ("format", "files")}
    manifest["robot"] = {**manifest["robot"], "fingerprint": "00" * 32}
    manifest["control_timestep"] = 0.05
    run.bundle = replace(run.bundle, manifest=manifest)
    changed = changes_since(run)
    assert [line.split()[0] for line in changed] == ["control_timestep", "robot.fingerprint"]
    assert changed[0] == "control_timestep was 0.05, and is now 0.04"


def test_what_a_policy_says_of_itself_is_told_without_running_it() -> None:
    bundle = read_pretrained(REACH)
    told = describe_pretrained(bundle)
    assert told["license"] == "MIT"
    assert told["command"].startswith(f"frobs train {REACH}")
    assert told["seconds"] > 0.0
    assert told["success_rate"] == claimed_evaluation(bundle)["success_rate"]  # type: ignore[index]
    assert len(told["sha256"]) == 64
    assert told["episodes"] == 1000


def test_a_bundle_without_an_evaluation_claims_nothing(tmp_path: Path) -> None:
    path = tmp_path / "silent.frobs"
    path.write_bytes(pack_bundle({"training": {"algorithm": "ppo"}}, b"", "MIT"))
    bundle = read_bundle(path)
    assert claimed_evaluation(bundle) is None
    assert describe_pretrained(bundle)["success_rate"] is None


def test_ids_with_a_policy_are_those_that_a_record_names() -> None:
    assert REACH in registry.pretrained_ids()
    assert all(registry.find_spec(id) for id in registry.pretrained_ids())

"""Static pages: what they repeat of Python, exactly, and what is refused."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from page_episodes import compare, play, run_with
from typer.testing import CliRunner, Result

from frobs_cli.program import program
from frobs_core.util.errors import ConfigurationError, PolicyExportError
from frobs_deploy import read_bundle
from frobs_train import BundleRun, open_pretrained, resolve_config, train
from frobs_train.export.export import export
from frobs_view import page
from frobs_view.page import NAMES, write_page

REACH = "frobs/Irb120Reach-v0"
PICK = "frobs/PandaPickAndPlace-v0"
LARGEST = 7_000_000
"""Most bytes of a page that a server sends, compressed."""


@pytest.fixture
def hollow_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Empty files in the place of those of 'make page'."""
    folder = tmp_path / "page_files"
    folder.mkdir()
    for name in NAMES:
        (folder / name).touch()
    monkeypatch.setattr(page, "FILES", folder)
    return folder


def gripper(name: str) -> dict[str, Any]:
    """Return keywords with another controller of the gripper."""
    controllers = {"arm": "tcp_delta_pose", "gripper": name}
    return {"controller": controllers, "controller_kwargs": {"arm": {"max_delta": 0.02, "axes": ["x", "y", "z"]}}}


def check(result: dict[str, Any], positions: float) -> None:
    """Check the deviations of replayed episodes."""
    assert result["positions"] <= positions
    assert max(result["observation"].values()) <= positions / 100.0  # velocities of contacts differ between processors
    assert result["control"] <= 1e-9


@pytest.mark.needs("page")
@pytest.mark.parametrize(
    ("id", "positions"),
    [
        (REACH, 1e-6),
        pytest.param("frobs/Ur5Reach-v0", 1e-6, marks=pytest.mark.slow),
        pytest.param("frobs/Ur5ReachGoal-v0", 1e-6, marks=pytest.mark.slow),
        pytest.param("frobs/PandaPush-v0", 1e-5, marks=pytest.mark.slow),
        pytest.param(PICK, 1e-5, marks=pytest.mark.slow),
        pytest.param("frobs/PandaPickAndPlaceGoal-v0", 1e-5, marks=pytest.mark.slow),
        pytest.param("frobs/Ur5Lift-v0", 1e-5, marks=pytest.mark.slow),
    ],
)
def test_a_page_repeats_the_episodes_of_python(tmp_path: Path, id: str, positions: float) -> None:
    run = open_pretrained(id)
    write_page(run, tmp_path, starts=20)
    result = compare(tmp_path, play(run, 20, 5))
    check(result, positions)
    assert result["action"] <= 1e-5
    assert result["different"] <= 1


@pytest.mark.slow
@pytest.mark.needs("page")
@pytest.mark.parametrize(
    ("id", "keywords"),
    [
        (REACH, {"controller_kwargs": {"full_range": True}}),
        (REACH, {"controller": "tcp_delta_position"}),
        (REACH, {"controller": "tcp_delta_pose", "controller_kwargs": {"posture_gain": 0.0}}),
        (PICK, {"controller_kwargs": {"max_delta": 0.05, "interpolate": True}}),
        (PICK, {"controller_kwargs": {"axes": ["x", "y", "z"], "free_yaw": True}}),
        (PICK, gripper("gripper_binary")),
        (PICK, gripper("gripper_position")),
    ],
    ids=["full range", "point", "pose", "interpolate", "free yaw", "binary", "position"],
)
def test_controllers_repeat_random_actions(tmp_path: Path, id: str, keywords: dict[str, Any]) -> None:
    run = run_with(open_pretrained(id), **keywords)
    write_page(run, tmp_path, starts=3)
    check(compare(tmp_path, play(run, 3, 3, random=True)), 1e-6)


@pytest.mark.slow
@pytest.mark.needs("page")
def test_a_policy_with_a_memory_repeats_its_actions(tmp_path: Path) -> None:
    settings = ["history=4", "net_arch=[16]", "updates=10", "final_updates=10"]
    config = resolve_config(
        "frobs/PandaPush-v0",
        flags={"algorithm": "dagger", "num_envs": 4, "steps": 1_000, "seed": 0},
        settings=[f"algorithm_config.{setting}" for setting in settings],
    )
    run = BundleRun(read_bundle(export(train(config, tmp_path / "run")).path))
    write_page(run, tmp_path / "page", starts=3)
    result = compare(tmp_path / "page", play(run, 3, 3))
    check(result, 1e-5)
    assert result["action"] <= 1e-5


@pytest.mark.needs("page")
def test_a_page_is_small_and_has_all_licenses(tmp_path: Path) -> None:
    facts = write_page(open_pretrained(PICK), tmp_path)
    sizes = {path.name: len(gzip.compress(path.read_bytes(), 6)) for path in tmp_path.iterdir()}
    assert sum(sizes.values()) <= LARGEST
    assert facts["files"] == len(sizes)
    licenses = (tmp_path / "THIRD_PARTY_LICENSES").read_text("utf-8")
    for name in ("three", "@mujoco/mujoco", "onnxruntime-web", "Apache License", "Emscripten"):
        assert name in licenses
    assert (tmp_path / "POLICY_LICENSE").read_text("utf-8") == open_pretrained(PICK).bundle.license


def test_a_page_stores_its_starts_and_limits(tmp_path: Path, hollow_files: Path) -> None:
    write_page(open_pretrained("frobs/PandaPush-v0"), tmp_path / "page", starts=5)
    facts = json.loads((tmp_path / "page" / "page.json").read_text("utf-8"))
    assert len(facts["starts"]) == 5
    assert facts["goal"]["low"][2] == facts["goal"]["high"][2] == pytest.approx(0.02)
    assert facts["success"]["hold_steps"] == 5
    assert [law["law"] for law in facts["controllers"]] == ["tcp_delta_pose", "gripper_delta"]
    write_page(open_pretrained(REACH), tmp_path / "page", starts=2)  # replaces it
    assert json.loads((tmp_path / "page" / "page.json").read_text("utf-8"))["id"] == REACH


def test_a_page_states_the_success_rate_in_the_simulator_of_the_page(tmp_path: Path, hollow_files: Path) -> None:
    run = open_pretrained(REACH)
    training = dict(run.bundle.manifest["training"])
    training["evaluations"] = [
        {"simulator": None, "episodes": 100, "success_rate": 0.9},
        {"simulator": "pybullet", "episodes": 200, "success_rate": 0.2},
        {"simulator": None, "episodes": 300, "success_rate": 0.3, "randomize": {"mass": {}}},
    ]
    run.bundle = replace(run.bundle, manifest={**run.bundle.manifest, "training": training})
    write_page(run, tmp_path / "page", starts=1)
    assert json.loads((tmp_path / "page" / "page.json").read_text("utf-8"))["training"]["success_rate"] == 0.9


REFUSED: dict[str, tuple[str, dict[str, Any], str]] = {
    "task": ("frobs/PandaStack-v0", {}, "the task Stack; it knows .*PickAndPlace"),
    "controller": ("frobs/Irb120ReachVelocity-v0", {}, "the controller JointVelocity of 'robot/all'; it knows joint_d"),
    "base": ("frobs/KobukiEmpty-v0", {}, "no robot with a wheeled base; choose an arm"),
    "moving goal": ("frobs/Ur5ReachDynamic-v0", {}, "the task ReachDynamic"),
    "term": (
        REACH,
        {"observations": {"efforts": {"type": "joint_efforts"}}},
        "the observation term 'efforts'; train without it",
    ),
    "camera": (
        REACH,
        {"observations": {"picture": {"type": "camera", "camera": "overview"}}},
        "the camera picture 'picture'; train without it",
    ),
    "simulator": (PICK, {"simulator": "pybullet"}, "not with the simulator 'pybullet'; train with simulator=mujoco"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_unsupported_parts_are_refused_by_name(
    tmp_path: Path, hollow_files: Path, name: str, request: pytest.FixtureRequest
) -> None:
    id, keywords, message = REFUSED[name]
    if name == "simulator":
        pytest.importorskip("pybullet")
    with pytest.raises(PolicyExportError, match=message):
        write_page(run_with(open_pretrained(id), **keywords), tmp_path / "page", starts=1)
    assert not (tmp_path / "page").exists()


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        ("randomize", {"mass": {"range": [0.9, 1.1]}}, r"randomizes its environment \(mass\).*train without"),
        (
            "wrappers",
            [{"name": "gymnasium.wrappers:ClipAction"}],
            r"wraps its environment \(gymnasium.wrappers:ClipAct",
        ),
    ],
)
def test_unsupported_settings_are_refused_by_name(
    tmp_path: Path, hollow_files: Path, setting: str, value: Any, message: str
) -> None:
    run = run_with(open_pretrained(REACH))
    run.config = type(run.config).model_validate({**run.config.model_dump(), setting: value})
    with pytest.raises(PolicyExportError, match=message):
        write_page(run, tmp_path / "page", starts=1)


def test_missing_files_name_the_command_that_builds_them(tmp_path: Path, hollow_files: Path) -> None:
    (hollow_files / "app.js").unlink()
    with pytest.raises(ConfigurationError, match=r"missing: app\.js; run 'make page'"):
        write_page(open_pretrained(REACH), tmp_path / "page")


def test_other_folders_are_not_overwritten(tmp_path: Path, hollow_files: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(ConfigurationError, match="exists and is not a page; choose another folder"):
        write_page(open_pretrained(REACH), tmp_path)


def export_command(*arguments: object) -> Result:
    return CliRunner().invoke(program(), ["export", *map(str, arguments)], prog_name="frobs")


def test_the_command_writes_pages_of_bundles_and_pretrained_policies(tmp_path: Path, hollow_files: Path) -> None:
    done = export_command(REACH, "--pretrained", "--page", tmp_path / "page", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["page"]["files"] == len(NAMES) + 4
    bundle = open_pretrained(REACH).path
    done = export_command(bundle, "--page", tmp_path / "page")
    assert done.exit_code == 0, done.stderr
    assert f"python -m http.server --directory {tmp_path / 'page'}" in " ".join(done.stdout.split())
    assert "this policy is exported already; add --page FOLDER" in export_command(bundle).stderr
    assert "--pretrained and --out cannot be combined" in " ".join(
        export_command(REACH, "--pretrained", "--page", tmp_path / "page", "--out", "x.frobs").stderr.split()
    )


def test_the_command_names_the_distribution_that_writes_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frobs_train.export.pages.entry_points", lambda group: [])
    done = export_command(REACH, "--pretrained", "--page", tmp_path / "page")
    assert done.exit_code != 0
    assert "--page needs frobs-view; install with: pip install" in " ".join(done.stderr.split())

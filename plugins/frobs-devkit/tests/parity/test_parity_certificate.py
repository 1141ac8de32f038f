from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, UnknownNameError
from frobs_devkit.parity import Certificate, Comparison, Measurement, Status, measure, measure_parity
from frobs_devkit.parity.certificate import number
from frobs_train import Run, resolve_config, train

ID = "frobs/Irb120Reach-v0"
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def certificate() -> Certificate:
    return measure_parity(ID, ["mujoco", "mujoco"])


@pytest.fixture(scope="module")
def small() -> Certificate:
    return measure_parity(ID, ["mujoco", "mujoco"], only=["settling"])


def comparison(status: Status, **fields: Any) -> Comparison:
    return Comparison(quantity="angle", simulator="b", against="a", status=status, **fields)


def made_of(*comparisons: Comparison, **fields: Any) -> Certificate:
    measurement = Measurement(name="turn", title="Turn", summary="It turns.", comparisons=comparisons)
    made = {"id": ID, "reference": "a", "simulators": ("a", "b"), "facts": {}, "versions": {}, **fields}
    return Certificate(measurements=(measurement,), **made)


@pytest.mark.slow
def test_a_certificate_is_complete(certificate: Certificate, tmp_path: Path) -> None:
    certificate.write(tmp_path / "new" / "folder")
    folder = tmp_path / "new" / "folder"
    found = json.loads((folder / "certificate.json").read_text())
    assert found["passed"] is True
    assert found["simulators"] == ["mujoco (1)", "mujoco (2)"]
    skipped = [m["name"] for m in found["measurements"] if m["status"] != "passed"]
    assert skipped == ["sliding", "fall", "slip"]  # the task has no free body
    assert len(found["measurements"]) == 12
    for measurement in found["measurements"]:
        if measurement["name"] not in skipped:
            assert (folder / measurement["picture"]).read_bytes().startswith(PNG)
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]
    text = (folder / "certificate.md").read_text()
    assert "**Passed**" in text
    for measurement in found["measurements"]:
        assert (f"]({measurement['picture']})" in text) == (measurement["name"] not in skipped)
        assert f"## {measurement['title']}" in text
    with np.load(folder / "curves.npz") as curves:
        assert curves["gravity_drop/0/joint_2/1"].shape[0] == 2


def test_a_certificate_names_all_versions(small: Certificate) -> None:
    versions = small.to_dict()["versions"]
    assert set(versions["engines"]) == {"mujoco"}
    assert "frobs-sim-mujoco" in versions["plugins"]
    assert "numpy" in versions["libraries"]
    assert {"python", "platform", "machine", "frobs-core"} <= set(versions)


def test_what_it_replayed_can_be_given_again(small: Certificate, tmp_path: Path) -> None:
    small.write(tmp_path)
    again = measure_parity(ID, ["mujoco", "mujoco"], actions=tmp_path / "actions.json", only=["replay"])
    assert [m.name for m in again.measurements] == ["replay"]
    assert again.actions is not None
    assert small.actions is not None
    assert (again.actions.actions == small.actions.actions).all()


def test_a_new_certificate_replaces_the_old_and_nothing_else(small: Certificate, tmp_path: Path) -> None:
    small.write(tmp_path)
    (tmp_path / "mine.png").write_bytes(b"mine")
    made_of(comparison(Status.PASSED, error=0.0, tolerance=1.0)).write(tmp_path)
    assert not (tmp_path / "settling.png").exists()
    assert (tmp_path / "mine.png").read_bytes() == b"mine"
    assert json.loads((tmp_path / "certificate.json").read_text())["measurements"][0]["name"] == "turn"


def test_a_writing_that_fails_leaves_no_certificate(
    small: Certificate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small.write(tmp_path)

    def full(*_: Any) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr("frobs_devkit.parity.certificate.write_text", full)
    with pytest.raises(OSError, match="full"):
        small.write(tmp_path)
    assert not (tmp_path / "certificate.json").exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_folder_that_is_a_file_is_refused(small: Certificate, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match="cannot be created"):
        small.write(tmp_path / "file")


def test_one_failure_is_not_passed_and_skipping_everything_is_not_either() -> None:
    passed, failed = (
        comparison(Status.PASSED, error=0.0, tolerance=1.0),
        comparison(Status.FAILED, error=2.0, tolerance=1.0),
    )
    skipped = comparison(Status.SKIPPED, reason="it has none")
    assert made_of(passed, skipped).passed
    assert made_of(passed, skipped).verdict == "1 passed, 1 skipped"
    assert not made_of(passed, failed).passed
    assert not made_of(skipped).passed


def test_what_was_not_measured_is_no_number_in_json() -> None:
    (measurement,) = made_of(comparison(Status.FAILED, reason="it broke")).to_dict()["measurements"]
    json.dumps(measurement, allow_nan=False)
    assert measurement["comparisons"][0]["error"] is None


@pytest.mark.parametrize(
    ("simulator", "measurement", "reason"),
    [("blind", "lidar", "does not support 'rays'"), ("fixed", "replay", "task 'reach' needs 'teleport'")],
)
def test_what_a_simulator_cannot_do_is_skipped_with_the_reason(
    simulator: str, measurement: str, reason: str, isolated_plugins: Callable[..., object]
) -> None:
    isolated_plugins(installed=True, wrong="wrong_simulators")
    only = [measurement, "step_response"]
    found = {
        m.name: m
        for m in measure_parity(ID, ["mujoco", simulator], only=only, keywords={"initial": "random"}).measurements
    }
    (skipped,) = found[measurement].comparisons
    assert skipped.status is Status.SKIPPED
    assert reason in skipped.reason
    assert found["step_response"].status is Status.PASSED


def test_the_others_are_compared_when_one_cannot(isolated_plugins: Callable[..., object]) -> None:
    isolated_plugins(installed=True, wrong="wrong_simulators")
    plan = measure.Plan("Lidar", measure.lidar, needs=("rays",))
    subjects = measure.make_subjects(ID, ["mujoco", "blind", "farsighted"], {})
    found = measure._make("lidar", plan, subjects)
    assert {(c.simulator, c.status) for c in found.comparisons} == {
        ("farsighted", Status.FAILED),
        ("blind", Status.SKIPPED),
    }
    backwards = measure._make("lidar", plan, subjects[::-1][1:] + subjects[:1])
    assert {c.status for c in backwards.comparisons} == {Status.SKIPPED}
    assert "the reference" in backwards.comparisons[0].reason


def test_an_engine_that_raises_fails_and_the_rest_goes_on(isolated_plugins: Callable[..., object]) -> None:
    isolated_plugins(installed=True, wrong="wrong_simulators")
    found = measure_parity(ID, ["mujoco", "mad"], only=["forward_kinematics", "step_response", "lidar"])
    status = {m.name: m.status for m in found.measurements}
    assert status["forward_kinematics"] is Status.PASSED
    assert status["lidar"] is Status.PASSED
    assert status["step_response"] is Status.FAILED
    (failed,) = next(m for m in found.measurements if m.name == "step_response").comparisons
    assert failed.reason == "SimulationError: the engine has gone mad."
    assert not found.passed


@pytest.mark.parametrize("simulators", [["mujoco"], []])
def test_one_simulator_is_not_enough(simulators: list[str]) -> None:
    with pytest.raises(ConfigurationError, match="at least two simulators, got"):
        measure_parity(ID, simulators)


def test_an_unknown_simulator_is_named_with_how_to_install_it() -> None:
    with pytest.raises(UnknownNameError, match=r"no simulator is named 'newton'.*pip install frobs-sim-newton"):
        measure_parity(ID, ["mujoco", "newton"])


def test_an_unknown_measurement_is_named() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'lidar'"):
        measure_parity(ID, ["mujoco", "mujoco"], only=["lidars"])
    with pytest.raises(UnknownNameError, match="no measurement is named 'policy'"):
        measure_parity(ID, ["mujoco", "mujoco"], only=["policy"])  # without a run


def test_an_environment_of_others_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="'CartPole-v1' is not a FRobs environment"):
        measure_parity("CartPole-v1", ["mujoco", "mujoco"])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run that has learned next to nothing."""
    config = resolve_config(
        ID,
        flags={"num_envs": 4, "steps": 256, "seed": 1},
        settings=["algorithm_config.n_steps=32", "environment_kwargs.tolerance=0.6"],
    )
    return train(config, tmp_path_factory.mktemp("runs") / "first")


def test_a_run_is_evaluated_on_each(run: Run, tmp_path: Path) -> None:
    found = measure_parity(ID, ["mujoco", "mujoco"], run=run, episodes=20, only=["policy"])
    (policy,) = found.measurements
    assert policy.name == "policy"
    assert policy.status is Status.PASSED
    assert policy.comparisons[0].error == 0.0
    assert policy.panels[0].bars.keys() == {"mujoco (1)", "mujoco (2)"}
    found.write(tmp_path)
    assert (tmp_path / "policy.png").read_bytes().startswith(PNG)


def test_a_run_of_another_environment_is_refused(run: Run) -> None:
    with pytest.raises(
        ConfigurationError,
        match="trained with the ID 'frobs/Irb120Reach-v0', but the environment has 'frobs/Irb120ReachGoal-v0'",
    ):
        measure_parity("frobs/Irb120ReachGoal-v0", ["mujoco", "mujoco"], run=run)


def test_numbers_are_short() -> None:
    assert [number(0.0, "m"), number(1.234e-14, "rad"), number(float("nan"), "m")] == ["0", "1.2e-14 rad", "–"]

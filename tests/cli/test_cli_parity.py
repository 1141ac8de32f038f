from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

Frobs = Callable[..., Result]
ID = "frobs/Irb120Reach-v0"

STIFF = """
from dataclasses import replace
from frobs_core.plugins.hooks import hookimpl
from frobs_sim_mujoco import plugin
from frobs_sim_mujoco.simulation import MujocoSimulation

class Stiff(MujocoSimulation):
    def __init__(self, robots, scene, **keywords):
        super().__init__(robots, scene, **keywords)
        for robot in self.robots.values():
            robot.drive_gains()[0][:] *= 1.05
            robot.apply_gains()

@hookimpl
def frobs_simulators():
    return [replace(plugin.frobs_simulators()[0], name="stiff", entry_point="stiff_engine_plugin:Stiff")]
"""


def test_parity_prints_one_table_and_writes_the_certificate(frobs: Frobs, tmp_path: Path) -> None:
    only = "saturated_step_response,settling"
    result = frobs("parity", ID, "--simulators", "mujoco,mujoco", "--only", only, "--out", str(tmp_path / "out"))
    assert result.exit_code == 0, result.stderr
    assert "Step response, saturated" in result.stdout
    assert "5 passed" in result.stdout
    assert str(tmp_path / "out") in result.stderr
    assert {"certificate.md", "certificate.json", "actions.json"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_parity_exits_with_1_where_something_differs(
    frobs: Frobs, installed: Callable[[str, str], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed("stiff-engine", STIFF)
    monkeypatch.chdir(tmp_path)
    only = "forward_kinematics,step_response"
    result = frobs("parity", ID, "--simulators", "mujoco,stiff", "--only", only, "--json")
    assert result.exit_code == 1
    found = json.loads(result.stdout)
    status = {m["name"]: m["status"] for m in found["measurements"]}
    assert status["step_response"] == "failed"
    assert status["forward_kinematics"] == "passed"
    assert found["folder"] == f"parity/{ID}"
    assert json.loads((tmp_path / "parity" / ID / "certificate.json").read_text())["passed"] is False


def test_parity_of_several_ids_is_one_table_with_a_certificate_each(
    frobs: Frobs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    other = "frobs/Ur5Reach-v0"
    options = ("--simulators", "mujoco,mujoco", "--only", "forward_kinematics")
    result = frobs("parity", ID, other, *options)
    assert result.exit_code == 0, result.stderr
    assert [row.split()[:2] for row in result.stdout.splitlines()[1:]] == [[name, "✓"] for name in (ID, other)]
    for name in (ID, other):
        assert (tmp_path / "parity" / name / "certificate.json").is_file()
    found = json.loads(frobs("parity", ID, other, *options, "--out", "out", "--json").stdout)
    assert [(row["id"], row["passed"], row["folder"]) for row in found] == [
        (name, True, str(tmp_path / "out" / name)) for name in (ID, other)
    ]


def test_one_id_that_fails_leaves_the_certificates_of_the_others(
    frobs: Frobs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = frobs("parity", "CartPole-v1", ID, "--simulators", "mujoco,mujoco", "--only", "forward_kinematics")
    assert result.exit_code == 1
    assert "4 passed" in result.stdout
    assert "error: 1 of 2 jobs failed. CartPole-v1: " in result.stderr


def test_a_run_belongs_to_one_id(frobs: Frobs) -> None:
    result = frobs("parity", ID, "frobs/Ur5Reach-v0", "--run", "runs/first")
    assert result.exit_code == 2
    assert "--run: this option requires a single ID" in result.stderr


@pytest.mark.parametrize(
    ("args", "message"),
    [
        ((ID, "--simulators", "mujoco"), "at least two simulators, got"),
        ((ID, "--simulators", "mujoco,newton"), "no simulator is named 'newton'"),
        (("CartPole-v1", "--simulators", "mujoco,mujoco"), "not a FRobs environment"),
        ((ID, "--simulators", "mujoco,mujoco", "--only", "lidars"), "Did you mean 'lidar'?"),
        (("frobs/Nothing-v0",), "no environment ID is named"),
        ((ID, "--simulators", "mujoco,mujoco", "--run", "nowhere"), "nowhere is not a folder"),
        ((ID, "--simulators", "mujoco,mujoco", "--actions", "none.json"), "does not exist"),
        ((ID, "--simulators", "mujoco,mujoco", "--actions", "wrong.json"), "shape (2, 3)"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    args: tuple[Any, ...], message: str, frobs: Frobs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.json").write_text(json.dumps({"id": ID, "seed": 0, "actions": [[0, 0, 0]] * 2}))
    result = frobs("parity", *args)
    assert result.exit_code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.json"]


def test_parity_accepts_a_module_and_the_options_of_a_robots_file(frobs: Frobs, tmp_path: Path) -> None:
    arm = "frobs_robots_ur:models/ur5.urdf.xacro"
    options = ["--robot", arm, "--tcp", "wrist_3_link", "--package-path", f"nothing={tmp_path}"]
    result = frobs(
        *("parity", "frobs_core:frobs/Reach-v0", *options, "--controller", "joint_position"),
        *("--simulators", "mujoco,mujoco", "--only", "forward_kinematics", "--out", str(tmp_path / "out")),
    )
    assert result.exit_code == 0, result.stderr
    found = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert found["id"] == "frobs/Reach-v0"
    assert "6 joints" in found["facts"]["robot"]


def test_bench_accepts_the_options_of_a_robots_file(frobs: Frobs, tmp_path: Path) -> None:
    arm = "frobs_robots_ur:models/ur5.urdf.xacro"
    options = ["--robot", arm, "--tcp", "wrist_3_link", "--package-path", f"nothing={tmp_path}"]
    result = frobs("bench", "frobs/Reach-v0", *options, "--controller", "joint_position", "--steps", "10", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["steps"] >= 10

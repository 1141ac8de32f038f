from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
import pytest
from robots import place

from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Scene
from frobs_core.models import Box, Pose
from frobs_core.util.errors import PluginError, RenderingUnavailableError
from frobs_sim_pybullet import plugin
from frobs_sim_pybullet.simulation import PybulletSimulation


def simulate(
    folder: Path, *names: str, num_envs: int = 3, scene: Scene | None = None, **placing: Any
) -> PybulletSimulation:
    robots = {("robot" if i == 0 else name): place(folder, name, **placing) for i, name in enumerate(names)}
    return PybulletSimulation(robots, scene or Scene(), num_envs=num_envs, physics_timestep=0.002, num_threads=1)


@pytest.mark.parametrize("limit", [200.0, 3.0], ids=["free", "saturated"])
def test_the_drive_law_holds_to_the_last_digit(tmp_path: Path, limit: float) -> None:
    folder = tmp_path
    placement = place(folder, "arm")
    text = (folder / "arm.urdf").read_text().replace('effort="200"', f'effort="{limit}"')
    (folder / "arm.urdf").write_text(text)
    placement = place.__globals__["Placement"](
        robot=placement.robot,
        model=place.__globals__["load_model"](folder / "arm.urdf"),
        command_mode=CommandMode.POSITION,
    )
    sim = PybulletSimulation({"robot": placement}, Scene(gravity=(0, 0, 0)), num_envs=1, physics_timestep=0.002)
    sim.reset()
    arm = sim.robots["robot"]
    kp, kd = (gain[0] for gain in arm.drive_gains())
    target = arm.joint_positions[0] + 0.4
    native = sim.native[0]
    h = 0.002
    saturated = 0
    for _ in range(50):
        q, v = arm.joint_positions[0].copy(), arm.joint_velocities[0].copy()
        body, client = native.robots["robot"], native.client
        mass = np.array(pybullet.calculateMassMatrix(body, q.tolist(), physicsClientId=client))
        bias = pybullet.calculateInverseDynamics(body, q.tolist(), v.tolist(), [0.0, 0.0], physicsClientId=client)
        effort = kp * (target - q) - kd * v
        clipped = np.abs(effort) >= limit
        saturated += clipped.any()
        effort = np.clip(effort, -limit, limit)
        acceleration = np.linalg.solve(mass + h * np.diag(np.where(clipped, 0.0, kd)), effort - bias)
        arm.command(target[None])
        sim.step(1)
        assert arm.joint_velocities[0] == pytest.approx(v + h * acceleration, abs=1e-12)
    assert (saturated > 5) == (limit == 3.0)


def test_names_of_bodies_may_contain_slashes(tmp_path: Path) -> None:
    body = Body(geometry=Box((0.1, 0.1, 0.1)), pose=Pose(pos=(1.0, 0.0, 2.0)), kinematic=True, collides=False)
    sim = simulate(tmp_path, "arm", num_envs=1, scene=Scene(bodies={"table/top/board": body}))
    np.testing.assert_allclose(sim.bodies["table/top/board"].pose[0], [[1.0, 0.0, 2.0]])
    np.testing.assert_allclose(sim.bodies["table/top/board"].twist[0], 0.0)
    assert not any("board" in name for name in sim.snapshot() if name.endswith(("pose", "twist")))
    sim.render(size=(6, 8))
    sim.close()


def test_a_window_without_a_display_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(RenderingUnavailableError, match="no display"):
        simulate(tmp_path, "arm", num_envs=1).open_viewer()


def test_a_python_without_a_wheel_is_told_which_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    for name in [name for name in sys.modules if name.startswith("frobs_sim_pybullet.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "version_info", (3, 13, 0, "final", 0))
    with pytest.raises(PluginError) as raised:
        plugin.frobs_simulators()[0].load()
    assert str(raised.value) == "PyBullet has no wheel for Python 3.13: use Python 3.11, or simulator='mujoco'"


def test_lists_on_a_python_without_a_wheel_say_which_has_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugin, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "version_info", (3, 13, 0, "final", 0))
    assert "has no wheel for Python 3.13: use Python 3.11" in plugin.frobs_simulators()[0].summary

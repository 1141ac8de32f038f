"""Finding Gazebo, and saying what to do where there is none; no Gazebo is needed for that."""

from __future__ import annotations

import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from frobs_core.description import Contact, Scene
from frobs_core.util.errors import ConfigurationError, SimulationError
from frobs_sim_gazebo.installation import find_gazebo, tool
from frobs_sim_gazebo.options import world_text
from frobs_sim_gazebo.simulation import GazeboSimulation


def test_without_a_gazebo_it_is_said_how_to_get_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FROBS_GAZEBO_ROOT", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SimulationError, match=r"apt-get install gazebo .*make_root\.sh"):
        GazeboSimulation({}, Scene(), num_envs=1, physics_timestep=0.002)


def test_a_half_made_root_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "usr/bin").mkdir(parents=True)
    (tmp_path / "usr/bin/gzserver").touch()
    monkeypatch.setenv("FROBS_GAZEBO_ROOT", str(tmp_path))
    with pytest.raises(SimulationError, match=rf"{tmp_path} .*incomplete; to create it, run: sudo .*make_root\.sh"):
        find_gazebo()


def test_a_scene_that_is_wrong_is_told_of_before_a_gazebo_is_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FROBS_GAZEBO_ROOT", str(tmp_path))
    with pytest.raises(ConfigurationError, match="refers to 'nobody'"):
        GazeboSimulation({}, Scene(contacts={"c": Contact(first="nobody")}), num_envs=1, physics_timestep=0.002)


def test_the_script_leaves_folders_alone_that_hold_something_else(tmp_path: Path) -> None:
    (tmp_path / "precious").touch()
    done = subprocess.run(["sh", str(tool()), str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "make_root: " in done.stderr  # that it holds something else, or what this machine lacks
    assert (tmp_path / "precious").exists()


def test_the_script_is_sound_shell_and_names_no_host() -> None:
    subprocess.run(["sh", "-n", str(tool())], check=True)
    assert "://" not in tool().read_text()


def test_engine_options_change_the_world_file_and_nothing_else() -> None:
    unchanged = world_text(solver=None, cfm=None)
    assert unchanged == world_text()
    changed = ElementTree.fromstring(world_text(solver="quick", iterations=20, cone="elliptic", cfm=0.01))
    found = {name: changed.findtext(f"world/physics/ode/{name}") for name in ("solver/type", "solver/iters")}
    assert found == {"solver/type": "quick", "solver/iters": "20"}
    assert changed.findtext("world/physics/ode/solver/friction_model") == "cone_model"
    assert changed.findtext("world/physics/ode/constraints/cfm") == "0.01"
    assert changed.findtext("world/physics/ode/constraints/erp") == "0.8"

from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import Result

from frobs_cli.describe_robot import describe_file
from frobs_cli.facts import print_facts
from frobs_core import plugins
from frobs_core.description import Bumper, Lidar, Robot
from frobs_core.plugins import registry
from frobs_core.plugins.records import KINDS

Frobs = Callable[..., Result]
Facts = Callable[..., Any]
QUICK = ("frobs/Irb120Reach-v0", "frobs/KobukiDynamic-v0", "frobs/PandaLift-v0")
NAMES = [f"{kind}:{name}" for kind in KINDS for name in plugins.importable(kind)]


@pytest.mark.parametrize("name", NAMES)
def test_every_record_can_be_shown(frobs: Frobs, facts: Facts, name: str) -> None:
    [found] = facts("show", name)
    kind, _, bare = name.partition(":")
    assert (found["kind"], found["name"]) == (kind, bare)
    assert "error" not in found
    assert found["summary"] in frobs("show", name).stdout


@pytest.mark.parametrize(
    "env_id", [id if id in QUICK else pytest.param(id, marks=pytest.mark.slow) for id in registry.environments()]
)
def test_every_environment_can_be_shown(facts: Facts, env_id: str) -> None:
    [found] = facts("show", env_id)
    assert found["kind"] == "environment"
    assert "error" not in found
    assert found["action_space"]
    assert found["observation_space"]
    assert found["reset_options"]
    assert {"simulator": "mujoco", "can_run_it": True, "lacks": ""} in found["simulators"]


def test_a_robot_shows_its_joints(facts: Facts) -> None:
    [found] = facts("show", "irb120")
    assert [joint["joint"] for joint in found["joints"]] == [f"joint_{i}" for i in range(1, 7)]
    assert all(joint["lower"] < joint["home"] < joint["upper"] for joint in found["joints"])


def test_a_robot_shows_its_sensors_with_their_units(capsys: pytest.CaptureFixture[str]) -> None:
    sensors = {
        "scan": Lidar(frame="link_6", rays=8, angle_min=0.0, range_min=0.1, range_max=5.0, noise=0.01, rate=10.0),
        "bumper": Bumper(frame="link_6"),
    }
    robot = Robot(model="frobs_robots_abb:models/irb120.urdf.xacro", name="irb120", sensors=sensors)
    found = describe_file(robot)
    scan, bumper = found["sensors"]
    assert (scan["type"], scan["unit"], scan["rate"], scan["noise"]) == ("lidar", "m", "10 Hz", 0.01)
    assert (bumper["unit"], bumper["noise"], bumper["delay"]) == ("0 or 1", None, None)
    print_facts(found)
    shown = capsys.readouterr().out
    assert "8 rays, 0° to 315°, 0.1 to 5 m" in shown
    assert "contacts of link_6, except with floor" in shown
    assert "dropout" not in shown  # none has any


def test_a_task_shows_its_parameters_with_defaults_and_meaning(facts: Facts) -> None:
    [found] = facts("show", "task:reach")
    [tolerance] = [row for row in found["parameters"] if row["name"] == "tolerance"]
    assert tolerance["default"] == 0.05
    assert "[m]" in tolerance["help"]
    assert all(row["help"] for row in found["parameters"])


def test_a_simulator_shows_every_capability(facts: Facts) -> None:
    from frobs_core.plugins.capabilities import CAPABILITIES

    [found] = facts("show", "mujoco")
    assert [row["capability"] for row in found["capabilities"]] == list(CAPABILITIES)


def test_a_simulator_shows_its_options_and_nothing_that_the_environment_sets(facts: Facts) -> None:
    [found] = facts("show", "simulator:mujoco")
    rows = {row["name"]: row["help"] for row in found["parameters"]}
    assert rows["solver"].startswith("Constraint solver")
    assert {"cone", "impratio", "iterations", "tolerance"} < rows.keys()
    assert not rows.keys() & {"robots", "scene", "num_envs", "physics_timestep", "num_threads"}
    assert all(rows.values())


def test_an_environment_shows_the_defaults_that_hold_for_it(facts: Facts) -> None:
    [found] = facts("show", "frobs/Irb120ReachLegacy-v0")
    [full_range] = [row for row in found["controller_parameters"] if row["name"] == "full_range"]
    assert full_range["default"] is True


def test_the_self_importing_form_is_the_same_environment(facts: Facts) -> None:
    assert facts("show", "frobs_core:frobs/Irb120Reach-v0") == facts("show", "frobs/Irb120Reach-v0")


def test_an_environment_of_others_is_shown_too(facts: Facts) -> None:
    [found] = facts("show", "CartPole-v1")
    assert found["action_space"] == "Discrete(2)"
    assert found["max_episode_steps"] == 500


def test_a_name_of_several_kinds_shows_all(frobs: Frobs, installed: Callable[[str, str], None]) -> None:
    installed("frobs-zz-other", TASK)
    result = frobs("show", "irb120")
    assert "irb120  robot" in result.stdout, result.stderr
    assert "irb120  task" in result.stdout
    assert "'robot:irb120', 'task:irb120'" in result.stderr
    assert "irb120  task" not in frobs("show", "robot:irb120").stdout


def test_an_implementation_that_cannot_be_imported_is_a_fact(
    frobs: Frobs, installed: Callable[[str, str], None]
) -> None:
    installed("frobs-zz-other", TASK)
    result = frobs("show", "task:irb120")
    assert result.exit_code == 0, result.stderr
    assert "No module named 'frobs_zz_nowhere'" in result.stdout


def test_a_name_of_two_distributions_must_say_which(frobs: Frobs, installed: Callable[[str, str], None]) -> None:
    installed("frobs-zz-other", TASK.replace("task", "robot").replace("Task", "Robot"))
    result = frobs("show", "irb120")
    assert result.exit_code == 2
    assert "'frobs-robots-abb:irb120'" in result.stderr
    assert "irb120  robot" in frobs("show", "frobs-robots-abb:irb120").stdout
    assert "irb120  robot" in frobs("show", "robot:frobs-robots-abb:irb120").stdout


TASK = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import TaskRecord

@hookimpl
def frobs_tasks():
    return [TaskRecord(name="irb120", summary="another", entry_point="frobs_zz_nowhere:TASK")]
"""

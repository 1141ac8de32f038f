"""Gymnasium IDs of real dist-info fixtures and of the installed plugins."""

import copy
import importlib
import json
import logging
import pickle
from contextlib import ExitStack

import gymnasium as gym
import pytest

from frobs_core.plugins import isolated, registry
from frobs_core.util.errors import AmbiguousNameError, UnknownNameError

REACH = "frobs/Irb120Reach-v0"


def tasks(*ids, task="press", **fields):
    """Return the source of a plugin that offers one task with these IDs."""
    fields = {"robot": "arm", "controller": "joint_position", "max_episode_steps": 7, **fields}
    keywords = ", ".join(f"{key}={value!r}" for key, value in fields.items())
    environments = "".join(f"EnvironmentRecord(id={id!r}, summary='s', {keywords}), " for id in ids)
    return (
        "from frobs_core.plugins.hooks import hookimpl\nfrom frobs_core.plugins.records import EnvironmentRecord, TaskRecord\n"
        f"@hookimpl\ndef frobs_tasks():\n    return [TaskRecord(name={task!r}, summary='s', entry_point='m:T',\n"
        f"        environments=({environments}))]\n"
    )


@pytest.fixture
def registered(site, caplog):
    """Register what a site offers and return the lines that were logged; undone after the test."""
    before = dict(gym.registry)
    registry._warn_once.cache_clear()
    with ExitStack() as stack:

        def register():
            stack.enter_context(isolated(site.plugins()))
            caplog.clear()
            registry.register_environments()
            return [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]

        yield register
    gym.registry.clear()
    gym.registry.update(before)
    registry._warn_once.cache_clear()


def test_every_installed_id_is_registered():
    assert REACH in registry.environments()
    for id, (task, environment) in registry.environments().items():
        spec = gym.spec(id)
        assert spec.max_episode_steps == environment.max_episode_steps
        assert spec.kwargs["task"] == task.name
    assert registry.problems() == {}


def test_the_compositional_id_leaves_everything_to_keywords():
    spec = gym.spec("frobs/Env-v0")
    assert spec.kwargs == {}
    assert spec.max_episode_steps == 100


def test_an_id_names_its_parts_as_plain_data(site, registered):
    site.add("press-dist", {"press.py": tasks("lab/Press-v3", parameters={"control_timestep": 0.05, "box": (1, 2)})})
    assert registered() == []
    spec = gym.spec("lab/Press-v3")
    assert spec.entry_point == "frobs_core.kernel.env:RobotEnv"
    assert spec.vector_entry_point == "frobs_core.kernel.mixed_vector_env:make_vector_env"
    assert spec.max_episode_steps == 7
    assert spec.kwargs == {
        "task": "press",
        "robot": "arm",
        "controller": "joint_position",
        "simulator": "mujoco",
        "control_timestep": 0.05,
        "box": (1, 2),
    }
    assert copy.deepcopy(spec) == spec
    assert pickle.loads(pickle.dumps(spec)) == spec
    assert json.loads(spec.to_json())["kwargs"]["box"] == [1, 2]


def test_registering_twice_changes_nothing(site, registered):
    site.add("press-dist", {"press.py": tasks("lab/Press-v0", parameters={"box": {"a": [1]}})})
    registered()
    spec = gym.spec("lab/Press-v0")
    assert registered() == []
    assert gym.spec("lab/Press-v0") is spec


def test_a_reload_changes_nothing(caplog):
    import frobs_core

    before = dict(gym.registry)
    importlib.reload(frobs_core)
    importlib.reload(frobs_core.plugins.registry).register_environments()
    assert gym.registry == before
    assert not caplog.records


def test_what_gymnasium_does_to_an_id_does_not_reach_the_record(site, registered):
    site.add("press-dist", {"press.py": tasks("lab/Press-v0", parameters={"box": {"a": [1]}})})
    registered()
    gym.spec("lab/Press-v0").kwargs["box"]["a"].append(2)
    (report,) = registry.plugins.reports()
    assert report.records["task"][0].environments[0].parameters == {"box": {"a": [1]}}


def test_another_packages_id_is_never_overwritten(site, registered):
    gym.register(id="lab/Press-v0", entry_point="somebody:Else")
    site.add("press-dist", {"press.py": tasks("lab/Press-v0", "lab/Other-v0", "CartPole-v1")})
    lines = registered()
    assert gym.spec("lab/Press-v0").entry_point == "somebody:Else"
    assert gym.spec("CartPole-v1").entry_point.startswith("gymnasium.")
    assert list(registry.environments()) == ["lab/Other-v0"]
    assert lines == [
        f"environment ID '{id}' of plugin 'press' of press-dist 1.0 is not registered: "
        "another package has already registered this ID"
        for id in ("lab/Press-v0", "CartPole-v1")
    ]
    assert list(registry.problems()) == ["lab/Press-v0", "CartPole-v1"]


def test_an_id_that_two_distributions_offer_goes_to_neither(site, registered):
    site.add("press-dist", {"press.py": tasks("lab/Press-v0")})
    site.add("Other.Dist", {"other.py": tasks("lab/Press-v0", "lab/Free-v0", robot="leg")}, version="2.0")
    assert registered() == [
        "environment ID 'lab/Press-v0' is provided by Other.Dist 2.0 and by press-dist 1.0; "
        "it is registered as 'other-dist/lab.Press-v0' and as 'press-dist/lab.Press-v0'"
    ]
    text = (
        "environment ID 'lab/Press-v0' is provided by Other.Dist 2.0 and by press-dist 1.0; "
        "request 'other-dist/lab.Press-v0' or 'press-dist/lab.Press-v0', or uninstall one of them."
    )
    asked = [
        lambda: gym.make("lab/Press-v0"),
        lambda: gym.make("frobs_core:lab/Press-v0", simulator="mujoco", render_mode="rgb_array"),
        lambda: gym.make_vec("lab/Press-v0", num_envs=3, vectorization_mode="vector_entry_point"),
        lambda: registry.find_environment("lab/Press-v0"),
    ]
    for ask in asked:
        with pytest.raises(AmbiguousNameError) as raised:
            ask()
        assert str(raised.value) == text
    assert list(registry.environments()) == ["lab/Free-v0", "other-dist/lab.Press-v0", "press-dist/lab.Press-v0"]
    assert registry.environments()["other-dist/lab.Press-v0"][1].id == "other-dist/lab.Press-v0"
    assert registered() == []  # the line has been said


def test_ids_stay_apart_that_differ_in_their_namespace_only_or_have_a_distributions_name(site, registered):
    site.add("lab", {"lab_module.py": tasks("lab/Press-v0", "other/Press-v0")})
    site.add("fork", {"fork_module.py": tasks("lab/Press-v0", "other/Press-v0")})
    assert len(registered()) == 2
    assert list(registry.environments()) == [
        f"{distribution}/{namespace}.Press-v0" for distribution in ("fork", "lab") for namespace in ("lab", "other")
    ]
    with pytest.raises(AmbiguousNameError):
        gym.make("lab/Press-v0")


def test_ids_of_tasks_with_one_name_find_their_own_task(site, registered):
    site.add("a-dist", {"a_module.py": tasks("lab/A-v0")})
    site.add("b-dist", {"b_module.py": tasks("lab/B-v0")})
    assert registered() == []
    assert gym.spec("lab/A-v0").kwargs["task"] == "a-dist:press"
    assert gym.spec("lab/B-v0").kwargs["task"] == "b-dist:press"


def test_an_id_whose_settings_the_user_has_changed_is_still_ours(site, registered):
    site.add("press-dist", {"press.py": tasks("lab/Press-v0")})
    registered()
    gym.spec("lab/Press-v0").max_episode_steps = 1000
    assert registered() == []
    assert list(registry.environments()) == ["lab/Press-v0"]
    assert gym.spec("lab/Press-v0").max_episode_steps == 1000


@pytest.mark.parametrize(
    ("id", "reason"),
    [
        ("lab/Press", "an ID must have the form 'namespace/Name-v0', with a version and without a colon"),
        ("lab/Press-v01", "an ID must have the form 'namespace/Name-v0', with a version and without a colon"),
        ("lab:x/Press-v0", "an ID must have the form 'namespace/Name-v0', with a version and without a colon"),
        ("lab/sub/Press-v0", "an ID must have the form 'namespace/Name-v0'"),
        ("", "an ID must have the form 'namespace/Name-v0'"),
        ("lab/Press v0", "an ID must have the form 'namespace/Name-v0'"),
        (None, "an ID must have the form 'namespace/Name-v0'"),
        ("frobs/Env-v0", "another FRobs environment uses this ID"),
    ],
)
def test_an_id_that_cannot_be_one_is_reported_and_the_others_are_registered(site, registered, id, reason):
    site.add("press-dist", {"press.py": tasks(id, "lab/Good-v0")})
    lines = registered()
    assert lines == [f"environment ID '{id}' of plugin 'press' of press-dist 1.0 is not registered: {reason}"]
    assert list(registry.environments()) == ["lab/Good-v0"]


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"max_episode_steps": 0}, "max_episode_steps is 0; it must be a whole number of at least 1"),
        ({"max_episode_steps": 1.5}, "max_episode_steps is 1.5; it must be a whole number of at least 1"),
        ({"robot": None}, "robot is None, not a name"),
        ({"parameters": 3}, "its parameters are not a mapping"),
        (
            {"parameters": {"x": {1, 2}}},
            "parameter 'x' has the unsupported type set; use numbers, strings, lists and dictionaries",
        ),
        ({"parameters": {"task": "other"}}, "parameter 'task' must be set as a field of the record"),
    ],
)
def test_a_record_that_gymnasium_cannot_carry_is_reported(site, registered, fields, reason):
    site.add("press-dist", {"press.py": tasks("lab/Press-v0", **fields)})
    assert registered() == [
        f"environment ID 'lab/Press-v0' of plugin 'press' of press-dist 1.0 is not registered: {reason}"
    ]


def test_a_versioned_id_beside_an_unversioned_one_of_somebody_is_reported(site, registered):
    gym.register(id="lab/Press", entry_point="somebody:Else")
    site.add("press-dist", {"press.py": tasks("lab/Press-v0", "lab/Good-v0")})
    (line,) = registered()
    assert line.startswith("environment ID 'lab/Press-v0' is not registered: Can't register the versioned environment")
    assert "lab/Good-v0" in gym.registry


@pytest.mark.parametrize("id", [REACH, f"frobs_core:{REACH}"])
def test_an_environment_is_found_by_its_id(id):
    task, environment = registry.find_environment(id)
    assert (task.name, environment.robot) == ("reach", "irb120")


def test_an_unknown_id_gets_the_nearest():
    with pytest.raises(UnknownNameError, match=f"Did you mean '{REACH}'"):
        registry.find_environment("frobs/Irb120Reech-v0")
    with pytest.raises(gym.error.NameNotFound, match="Did you mean: `Irb120Reach`"):
        gym.make("frobs_core:frobs/Irb120Reech-v0")


def test_an_unknown_id_says_what_could_not_be_loaded_or_registered(site, registered):
    site.add("broken-dist", {"broken.py": "1 / 0"})
    site.add("press-dist", {"press.py": tasks("lab/Press")})
    registered()
    with pytest.raises(UnknownNameError) as raised:
        registry.find_environment("lab/Press")
    assert "'broken' of broken-dist 1.0: ZeroDivisionError" in str(raised.value)
    assert "environment ID 'lab/Press' of plugin 'press'" in str(raised.value)

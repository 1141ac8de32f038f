"""Looking records up by name."""

import pytest

from frobs_core import plugins as installed
from frobs_core.util.errors import AmbiguousNameError, UnknownNameError


def two_arms(site):
    site.add_robot("abb-arms", "abb_module", version="1.0")
    site.add_robot("other-arms", "other_module", version="2.1")
    site.add_robot("third", "third_module", "leg")
    return site.plugins()


def test_names_that_two_distributions_offer_stay_as_distribution_and_name(site):
    assert list(two_arms(site).records("robot")) == ["abb-arms:arm", "leg", "other-arms:arm"]


def test_a_bare_name_that_two_offer_fails_when_it_is_asked_for(site):
    plugins = two_arms(site)
    with pytest.raises(AmbiguousNameError) as raised:
        plugins.get_record("robot", "arm")
    assert str(raised.value) == (
        "robot 'arm' is provided by abb-arms 1.0 and by other-arms 2.1; "
        "request 'abb-arms:arm' or 'other-arms:arm', or uninstall one of them."
    )
    assert raised.value.distributions == ("abb-arms 1.0", "other-arms 2.1")


@pytest.mark.parametrize("name", ["other-arms:arm", "Other_Arms:arm"])
def test_a_name_with_its_distribution_is_found(site, name):
    assert two_arms(site).get_report("robot", name).origin == "other-arms 2.1"


def test_a_name_with_its_distribution_is_found_where_nobody_else_offers_it(site):
    plugins = two_arms(site)
    assert plugins.get_record("robot", "third:leg") is plugins.get_record("robot", "leg")


def test_one_name_of_two_kinds_is_no_clash(site):
    site.add_robot("arms", "arm_module", "same")
    source = (
        "from frobs_core.plugins.hooks import hookimpl\nfrom frobs_core.plugins.records import ControllerRecord\n"
        "@hookimpl\ndef frobs_controllers():\n"
        "    return [ControllerRecord(name='same', summary='s', entry_point='m:C')]\n"
    )
    site.add("controllers", {"controller_module.py": source})
    plugins = site.plugins()
    assert plugins.get_record("robot", "same") != plugins.get_record("controller", "same")


def test_a_name_twice_in_one_distribution_is_refused_for_the_second_plugin(site):
    site.add_robot("one", "module_one")
    site.add_robot("two", "module_two")
    (site.path / "one-1.0.dist-info" / "entry_points.txt").write_text("[frobs]\na = module_one\nb = module_two\n")
    (site.path / "two-1.0.dist-info" / "entry_points.txt").unlink()
    plugins = site.plugins()
    assert [report.state for report in plugins.reports()] == ["loaded", "failed"]
    assert plugins.reports()[1].cause == "robot 'arm' is also provided by plugin 'a' of the same distribution"


def test_an_id_twice_in_one_distribution_is_refused_for_the_second_plugin(site):
    source = (
        "from frobs_core.plugins.hooks import hookimpl\nfrom frobs_core.plugins.records import EnvironmentRecord, TaskRecord\n"
        "@hookimpl\ndef frobs_tasks():\n"
        "    one = EnvironmentRecord(id='lab/X-v0', summary='s', robot='r', controller='c', max_episode_steps=5)\n"
        "    return [TaskRecord(name={!r}, summary='s', entry_point='m:T', environments=(one,))]\n"
    )
    modules = {"task_a.py": source.format("a"), "task_b.py": source.format("b")}
    site.add("tasks", modules, points={"a": "task_a", "b": "task_b"})
    assert [report.cause for report in site.plugins().reports()] == [
        "",
        "environment ID 'lab/X-v0' is also provided by plugin 'a' of the same distribution",
    ]


def test_an_unknown_name_gets_the_nearest_and_what_failed_to_load(site):
    site.add_robot("arms", "arm_module", "gripper")
    site.add("broken-dist", {"broken.py": "import no_such_module"}, version="0.3")
    site.add("off-dist", {"off.py": "1 / 0"})
    with pytest.raises(UnknownNameError) as raised:
        site.plugins(disabled=["off"]).get_record("robot", "griper")
    assert str(raised.value) == (
        "no robot is named 'griper'. Did you mean 'gripper'? Available: gripper. Plugins that failed to load: "
        "'broken' of broken-dist 0.3: ModuleNotFoundError: No module named 'no_such_module'; "
        "'off' of off-dist 1.0: disabled by FROBS_DISABLE_PLUGINS."
    )


@pytest.mark.parametrize(
    ("kind", "name", "package"),
    [
        ("simulator", "mujoco", "frobs-sim-mujoco"),
        ("robot", "irb120", "frobs-robots-abb"),
        ("controller", "joint_position", "frobs-controllers"),
        ("task", "reach", "frobs-tasks-reach"),
        ("algorithm", "ppo", "frobs-algos-sb3"),
    ],
)
def test_a_built_in_that_is_not_installed_says_how_to_install_it(site, kind, name, package):
    with pytest.raises(UnknownNameError, match=rf"To install it: pip install -e .*plugins/{package}"):
        site.plugins().get_record(kind, name)


def test_an_installed_but_broken_built_in_is_not_to_be_installed_again(site):
    site.add("frobs-sim-mujoco", {"sim_module.py": "1 / 0"})
    with pytest.raises(UnknownNameError) as raised:
        site.plugins().get_record("simulator", "mujoco")
    assert "pip install" not in str(raised.value)
    assert "ZeroDivisionError" in str(raised.value)


def test_an_unknown_kind_is_refused(site):
    with pytest.raises(UnknownNameError, match=r"no kind is named 'robots'\. Did you mean 'robot'"):
        site.plugins().records("robots")
    with pytest.raises(UnknownNameError, match="no kind is named 'sim'"):
        site.plugins().get_record("sim", "mujoco")


def test_an_isolated_collection_takes_the_place_of_the_installed_one(site):
    site.add_robot("arms", "arm_module", "isolated_arm")
    with installed.isolated(site.plugins()) as plugins:
        assert installed.active() is plugins
        assert list(installed.records("robot")) == ["isolated_arm"]
        assert [report.name for report in installed.reports()] == ["arm_module"]
        assert installed.get_record("robot", "isolated_arm").summary == "s"
        assert installed.get_report("robot", "isolated_arm").distribution == "arms"
    assert "isolated_arm" not in installed.records("robot")


def test_records_cannot_be_changed(site):
    plugins = two_arms(site)
    with pytest.raises(TypeError):
        plugins.records("robot")["mine"] = None
    with pytest.raises(TypeError):
        plugins.reports()[0].records["robot"] = ()


def test_what_cannot_be_imported_here_is_left_out_of_what_can(site):
    assert "mujoco" in installed.importable("simulator")
    site.add_robot("arms", "arm_module", "without_a_model")
    with installed.isolated(site.plugins()):
        assert list(installed.records("robot")) == ["without_a_model"]
        assert installed.importable("robot") == []

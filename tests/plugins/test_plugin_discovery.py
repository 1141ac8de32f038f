"""Which entry points are found, and which of them are left alone."""

import sys

import pytest

from frobs_core.plugins import Plugins


def states(plugins):
    return {f"{report.distribution}:{report.name}": report.state for report in plugins.reports()}


def test_nothing_installed_is_no_error(site):
    assert site.plugins().reports() == ()


def test_the_installed_plugins_are_found_without_being_told_where():
    assert "robots_abb" in [report.name for report in Plugins().reports()]


def test_entry_points_of_one_name_from_two_distributions_are_both_loaded(site):
    for dist, arm in (("first-dist", "arm_1"), ("second-dist", "arm_2")):
        site.add_robot(dist, f"{arm}_module", arm)
        info = site.path / f"{dist.replace('-', '_')}-1.0.dist-info"
        (info / "entry_points.txt").write_text(f"[frobs]\nrobots = {arm}_module\n")
    plugins = site.plugins()
    assert states(plugins) == {"first-dist:robots": "loaded", "second-dist:robots": "loaded"}
    assert list(plugins.records("robot")) == ["arm_1", "arm_2"]


def test_two_entry_points_of_a_distribution_are_two_plugins(site):
    site.add_robot("one-dist", "one", "arm_1")
    site.add("two-dist", {"two.py": "1 / 0"}, points={"a": "one", "b": "two"})
    assert states(site.plugins()) == {"one-dist:one": "loaded", "two-dist:a": "loaded", "two-dist:b": "failed"}


def test_a_distribution_that_is_found_twice_counts_once_and_the_first_wins(site, tmp_path):
    site.add_robot("same-dist", "same", "arm", version="2.0")
    stale = site.path / "same_dist-1.0.dist-info"
    first = tmp_path / "first"
    first.mkdir()
    (site.path / "same_dist-2.0.dist-info").rename(first / "same_dist-2.0.dist-info")
    stale.mkdir()
    (stale / "METADATA").write_text("Name: Same.Dist\nVersion: 1.0\n")
    (stale / "entry_points.txt").write_text("[frobs]\nsame = same\n")
    from importlib.metadata import distributions

    plugins = Plugins(distributions(path=[str(first), str(site.path)]))
    assert [report.origin for report in plugins.reports()] == ["same-dist 2.0"]


@pytest.mark.parametrize("value", ["module:attribute", "module [extra]", "not a module", "3d", "a..b", ""])
def test_an_entry_point_that_names_no_module_is_reported(site, value):
    site.add_robot("good-dist", "good")
    site.add("bad-dist", {"module.py": "attribute = 1"}, points={"bad": value})
    bad, good = site.plugins().reports()
    assert good.state == "loaded"
    assert bad.cause == f"the entry point is '{value}'; it must be the name of a module, such as 'package.plugin'"


def test_an_entry_point_file_that_cannot_be_read_is_reported(site):
    site.add_robot("good-dist", "good")
    site.add("bad-dist", {"module.py": ""}, entry_points="[frobs]\nthis line has no equals sign\n")
    bad, good = site.plugins().reports()
    assert good.state == "loaded"
    assert bad.cause.startswith("entry_points.txt cannot be read: ")
    assert bad.origin == "bad-dist 1.0"


def test_damaged_distributions_of_others_are_none_of_our_business(site, caplog):
    site.add_robot("good-dist", "good")
    site.add("other-dist", {"other.py": ""}, entry_points="[console_scripts]\nthis line has no equals sign\n")
    site.add("odd-dist", {"odd.py": ""})
    (site.path / "odd_dist-1.0.dist-info" / "entry_points.txt").write_bytes(b"[frobs\xff\xfe]\n")
    (site.path / "empty-1.0.dist-info").mkdir()
    assert states(site.plugins()) == {"good-dist:good": "loaded"}
    assert not caplog.records


def test_a_distribution_without_metadata_is_loaded_under_no_name(site):
    site.add_robot("anonymous", "anonymous")
    (site.path / "anonymous-1.0.dist-info" / "METADATA").unlink()
    (report,) = site.plugins().reports()
    assert report.state == "loaded"
    assert report.origin == "(unnamed distribution) (no version)"


def test_one_name_twice_in_a_distribution_is_reported(site):
    site.add("twice-dist", {"twice.py": ""}, entry_points="[frobs]\nsame = a.b\nsame = c.d\n")
    reports = site.plugins().reports()
    assert reports[1].cause == "the distribution has two entry points named 'same'"


@pytest.mark.parametrize("word", ["off", "Off_Dist", "off-dist", "off.dist:off", " off "])
def test_a_disabled_plugin_is_not_imported(site, caplog, monkeypatch, word):
    site.add("off-dist", {"off.py": "raise SystemExit"})
    site.add_robot("good-dist", "good")
    monkeypatch.setenv("FROBS_DISABLE_PLUGINS", f"{word},")
    plugins = site.plugins()
    assert states(plugins) == {"good-dist:good": "loaded", "off-dist:off": "disabled"}
    assert "off" not in sys.modules
    assert plugins.reports()[1].cause == "disabled by FROBS_DISABLE_PLUGINS"
    assert not caplog.records


def test_several_can_be_disabled_and_a_distribution_name_disables_all_of_its_plugins(site):
    for name in ("a", "b", "c"):
        site.add_robot(f"{name}-dist", f"{name}_module", f"arm_{name}")
    site.add("pair-dist", {"p.py": "1/0", "q.py": "1/0"}, points={"p": "p", "q": "q"})
    plugins = site.plugins(disabled=["pair-dist", "a_module", "b-dist:b_module"])
    assert [key for key, state in states(plugins).items() if state == "loaded"] == ["c-dist:c_module"]


def test_an_unknown_word_in_the_disabled_is_noted(site, caplog):
    site.add_robot("good-dist", "good_module")
    assert states(site.plugins(disabled=["good_modul", "zzz"])) == {"good-dist:good_module": "loaded"}
    assert [record.getMessage() for record in caplog.records] == [
        "FROBS_DISABLE_PLUGINS contains 'good_modul', which is not an installed plugin; did you mean 'good_module'?",
        "FROBS_DISABLE_PLUGINS contains 'zzz', which is not an installed plugin",
    ]

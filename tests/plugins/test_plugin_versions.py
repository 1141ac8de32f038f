"""Plugins that are made for some versions of the core, and the way in which things go."""

import tomllib
import warnings
from pathlib import Path

import pytest

from frobs_core import __version__
from frobs_core.deprecation import FrobsDeprecationWarning, deprecated, warn_deprecated
from frobs_core.plugins.discovery import core_versions, is_made_for
from frobs_devkit.doctor.requirements import has_upper_bound

ROOT = Path(__file__).parents[2]
PROJECTS = sorted(ROOT.glob("plugins/*/pyproject.toml"))


def test_a_plugin_for_another_version_is_loaded_with_a_warning(site, caplog):
    site.add_robot("late-dist", "late", requires=("frobs-core>=7,<8",))
    site.add_robot("good-dist", "good", "other", requires=("frobs-core>=0.1,<1",))
    plugins = site.plugins()
    line = (
        f"plugin 'late' of late-dist 1.0 requires frobs-core >=7,<8, but version {__version__} is "
        "installed; to upgrade the plugin, run: pip install --upgrade late-dist"
    )
    assert [(r.name, r.state, r.warning) for r in plugins.reports()] == [
        ("good", "loaded", ""),
        ("late", "loaded", line),
    ]
    assert [record.getMessage() for record in caplog.records] == [line]
    assert list(plugins.records("robot")) == ["arm", "other"]


def test_a_broken_plugin_for_another_version_says_both(site):
    site.add("late-dist", {"late.py": "from frobs_core import what_came_later"}, requires=("frobs-core>=7",))
    (report,) = site.plugins().reports()
    assert report.cause.startswith("ImportError: cannot import name 'what_came_later'")
    assert report.cause.endswith(f"; the plugin requires frobs-core >=7, but version {__version__} is installed")


@pytest.mark.parametrize(
    ("line", "versions"),
    [
        ("frobs-core>=0.3,<0.4", ">=0.3,<0.4"),
        ("Frobs_Core (>=0.3, <0.4)", ">=0.3,<0.4"),
        ("frobs.core[video]~=0.2.0; python_version > '3'", "~=0.2.0"),
        ("frobs-core", ""),
        ("frobs-core-extras>=3", ""),
        ("numpy", ""),
    ],
)
def test_the_requirement_on_the_core_is_read(line, versions):
    assert core_versions(["numpy>=2", line]) == versions


def test_ranges_end_or_do_not():
    assert has_upper_bound(">=0.3,<0.4")
    assert has_upper_bound("~=0.2.0")
    assert not has_upper_bound(">=0.1")
    assert is_made_for("", "3.0")
    assert is_made_for("<0.2", "0.2.dev1") is False
    assert is_made_for("not a specifier", "3.0")


@pytest.mark.parametrize("path", PROJECTS, ids=lambda path: path.parent.name)
def test_our_own_plugins_are_made_for_this_core(path):
    versions = core_versions(tomllib.loads(path.read_text())["project"]["dependencies"])
    if path.parent.name == "frobs-deploy":
        assert versions == ""  # runs without the core
        return
    assert has_upper_bound(versions)
    assert is_made_for(versions, __version__)


def test_the_core_knows_its_version():
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == __version__


def test_a_deprecation_names_the_replacement_and_the_caller():
    @deprecated(instead="new", since="0.2", removed_in="0.3")
    def old(x):
        return 2 * x

    with pytest.warns(
        FrobsDeprecationWarning,
        match=r"old has been deprecated since frobs-core 0\.2 and will be removed in 0\.3; use new",
    ) as told:
        assert old(3) == 6
    assert told[0].filename == __file__
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        (lambda: warn_deprecated("a", instead="b", since="0.2", removed_in="0.3"))()
    assert told[0].filename == __file__

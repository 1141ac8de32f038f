from collections.abc import Callable
from typing import Any

from typer.testing import Result

Frobs = Callable[..., Result]
Facts = Callable[..., Any]
Install = Callable[[str, str], None]

BROKEN = "import frobs_needs_this"


def test_loaded_plugins_say_what_they_offer(frobs: Frobs) -> None:
    [line] = [line for line in frobs("plugins").stdout.splitlines() if "frobs-robots-abb" in line]
    assert "loaded" in line
    assert line.endswith("2 robots")


def test_a_broken_plugin_says_why(frobs: Frobs, installed: Install) -> None:
    installed("frobs-zz-broken", BROKEN)
    result = frobs("plugins")
    [line] = [line for line in result.stdout.splitlines() if "frobs-zz-broken" in line]
    assert result.exit_code == 0
    assert "failed" in line
    assert "1.5" in line
    assert "No module named 'frobs_needs_this'" in line
    assert "Traceback" not in result.stdout


def test_verbose_shows_the_traceback(frobs: Frobs, installed: Install) -> None:
    installed("frobs-zz-broken", BROKEN)
    text = frobs("plugins", "--verbose").stdout
    assert "Traceback" in text
    assert "frobs_zz_broken_plugin" in text


def test_json_has_every_field(facts: Facts, installed: Install) -> None:
    installed("frobs-zz-broken", BROKEN)
    by_distribution = {report["distribution"]: report for report in facts("plugins")["plugins"]}
    broken, good = by_distribution["frobs-zz-broken"], by_distribution["frobs-robots-abb"]
    assert (broken["state"], broken["version"]) == ("failed", "1.5")
    assert "Traceback" in broken["traceback"]
    assert (good["state"], good["cause"]) == ("loaded", "")
    assert good["records"]["robots"] == ["irb120", "irb140"]
    assert good["import_seconds"] >= 0


def test_list_points_to_what_did_not_load(frobs: Frobs, installed: Install) -> None:
    installed("frobs-zz-broken", BROKEN)
    result = frobs("list", "robots")
    assert "irb120" in result.stdout
    assert "run 'frobs plugins --verbose' to see why plugins did not load" in result.stderr

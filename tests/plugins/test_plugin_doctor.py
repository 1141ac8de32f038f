"""What the doctor says of plugins that are broken, hang, print, clash and change what belongs to everybody."""

import json
import os
import subprocess
import sys

import pytest

from frobs_core.plugins import isolated
from frobs_core.util.errors import UnknownNameError
from frobs_devkit.doctor import examine_plugins

CORE = ("frobs-core>=0.3,<0.4",)
GOOD = "\nfrom frobs_core.plugins.hooks import hookimpl\n@hookimpl\ndef frobs_robots():\n    return []\n"


@pytest.fixture
def examine(site):
    """Examine what a site holds; facts by plugin."""

    def run(seconds=30.0):
        with isolated(site.plugins()):
            return {facts.name: facts for facts in examine_plugins(seconds)}

    return run


def findings(facts):
    return {finding.code: finding for finding in facts.findings}


def test_a_sound_plugin_has_no_finding(site, examine):
    site.add_robot("good-dist", "good", requires=CORE)
    facts = examine()["good"]
    assert (facts.state, facts.findings, facts.sound) == ("loaded", (), True)
    assert facts.records["robot"] == ("arm",)
    assert 0 < facts.import_seconds < 1


def test_each_is_told_apart_and_none_reaches_the_others(site, examine, monkeypatch):
    site.add_robot("good-dist", "good", requires=CORE)
    site.add("broken-dist", {"broken.py": "def f():\n    1 / 0\nf()"}, requires=CORE)
    site.add("hanging-dist", {"hanging.py": "def forever():\n    while True: pass\nforever()"}, requires=CORE)
    site.add("dying-dist", {"dying.py": "import os; os._exit(7)"}, requires=CORE)
    monkeypatch.setenv("FROBS_DISABLE_PLUGINS", "hanging")
    facts = examine(seconds=2.0)
    assert {name: (one.state, one.sound) for name, one in facts.items()} == {
        "good": ("loaded", True),
        "broken": ("failed", False),
        "hanging": ("hanging", False),
        "dying": ("crashed", False),
    }
    assert facts["broken"].cause == "ZeroDivisionError: division by zero"
    assert "in f" in facts["broken"].traceback
    assert facts["hanging"].cause == "the import did not finish within 2 s"
    assert "in forever" in facts["hanging"].traceback
    assert facts["hanging"].disabled
    assert (
        findings(facts["hanging"])["hanging"].advice == "disable the plugin: FROBS_DISABLE_PLUGINS=hanging-dist:hanging"
    )
    assert facts["dying"].cause == "the import ended the process with exit code 7"


def test_what_it_prints_and_changes_is_told(site, examine):
    lines = (
        "import os, random, signal, sys, warnings",
        "print('hello')",
        "sys.stderr.write('oh dear')",
        "os.chdir('/'); os.environ['A'] = '1'; random.seed(0)",
        "warnings.simplefilter('ignore'); signal.signal(signal.SIGTERM, signal.SIG_IGN)",
        "warnings.warn('use the other', DeprecationWarning)",
    )
    site.add("rude-dist", {"rude.py": "\n".join(lines) + GOOD}, requires=CORE)
    facts = examine()["rude"]
    assert facts.state == "loaded"
    assert facts.sound
    assert (facts.stdout, facts.stderr) == ("hello\n", "oh dear")
    assert facts.changed == ("environment", "random state", "signal handlers", "warning filters", "working directory")
    assert {"prints", "global-state"} <= findings(facts).keys()


def test_deprecated_use_is_told_with_its_place(site, examine):
    source = (
        "from frobs_core.deprecation import deprecated\n"
        "@deprecated(instead='new', since='0.1', removed_in='0.2')\ndef old(): pass\nold()" + GOOD
    )
    site.add("old-dist", {"old.py": source}, requires=CORE)
    finding = findings(examine()["old"])["deprecated"]
    assert finding.about == "old.py:4"
    assert "old.old has been deprecated since frobs-core 0.1 and will be removed in 0.2; use new." in finding.problem


@pytest.mark.needs("torch")
@pytest.mark.slow
def test_torch_threads_are_told(site, examine):
    site.add("torch-dist", {"threads.py": "import torch; torch.set_num_threads(3)" + GOOD}, requires=CORE)
    facts = examine()["threads"]
    assert "torch threads" in facts.changed
    assert "imports torch" in findings(facts)["heavy-import"].problem


def test_missing_requirements_come_with_the_command(site, examine):
    requires = (*CORE, "no-such-engine>=4; python_version > '3'", "numpy>=99", "skipped; extra == 'more'")
    site.add("needy-dist", {"needy.py": "import no_such_engine"}, requires=requires)
    facts = examine()["needy"]
    commands = [finding.advice for finding in facts.findings if finding.code == "missing-requirement"]
    assert commands == ["pip install 'no-such-engine>=4'", "pip install --upgrade 'numpy>=99'"]
    assert findings(facts)["failed"].advice == "pip install 'no-such-engine>=4'"


def test_a_module_that_no_requirement_brings_is_named(site, examine):
    site.add("needy-dist", {"needy.py": "import no_such_engine"}, requires=CORE)
    assert "contains the module 'no_such_engine'" in findings(examine()["needy"])["failed"].advice


def test_clashes_are_told_to_both(site, examine):
    site.add_robot("first-dist", "first", requires=CORE)
    site.add_robot("second-dist", "second", version="2.0", requires=CORE)
    facts = examine()
    assert (
        findings(facts["first"])["clash"].problem
        == "another plugin also provides this name: 'second' of second-dist 2.0"
    )
    assert (
        findings(facts["second"])["clash"].advice == "use the name 'second-dist:arm', or uninstall one of the plugins"
    )
    assert facts["first"].sound


def test_a_plugin_under_two_names_of_one_distribution_is_an_error(site, examine):
    site.add("twice-dist", {"twice.py": (GOOD.replace("[]", "[RobotRecord(name='arm', summary='s', entry_point='a:B')]")
             + "from frobs_core.plugins.records import RobotRecord\n")}, points={"a": "twice", "b": "twice"}, requires=CORE)  # fmt: skip
    facts = examine()
    assert not facts["a"].sound
    assert findings(facts["b"])["clash"].about == "robot 'arm'"


def test_a_plugin_for_another_core_is_told(site, examine):
    site.add_robot("late-dist", "late", "arm_l", requires=("frobs-core>=7,<8",))
    site.add_robot("vague-dist", "vague", "arm_v", requires=("frobs-core",))
    facts = examine()
    assert findings(facts["late"])["other-core"].problem.startswith(
        "the plugin requires frobs-core >=7,<8, but version "
    )
    assert "without an upper bound" in findings(facts["vague"])["no-core-versions"].problem


def test_only_some_are_examined(site):
    site.add_robot("good-dist", "good", requires=CORE)
    site.add("hanging-dist", {"hanging.py": "while True: pass"})
    with isolated(site.plugins()):
        assert [facts.name for facts in examine_plugins(only=["good-dist"])] == ["good"]


def test_the_command_does_not_hang_where_importing_the_core_does(site):
    site.add("hanging-dist", {"hanging.py": "while True: pass"}, requires=CORE)
    command = [sys.executable, "-m", "frobs_cli", "doctor", "plugins", "hanging-dist", "--timeout", "1", "--json"]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(site.path)}, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    (facts,) = json.loads(done.stdout)["plugins"]
    assert (facts["state"], facts["findings"][0]["code"]) == ("hanging", "hanging")


def test_an_unknown_name_is_refused():
    from frobs_devkit.cli.doctor_plugins import plugins

    with pytest.raises(UnknownNameError, match="Did you mean 'robots_abb'"):
        plugins(["robot_abb"])

"""One plugin at a time: what can be wrong with it, and that it hurts nobody else."""

import sys
import threading

import pytest

from frobs_core.plugins import PluginReport, isolated
from frobs_core.util.errors import PluginError, PluginLoadError

HEADER = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import *
"""


def robots(*names):
    records = ", ".join(f"RobotRecord(name={name!r}, summary='s', entry_point='robots:ARM')" for name in names)
    return f"{HEADER}\n@hookimpl\ndef frobs_robots():\n    return [{records}]\n"


def hook(body, name="frobs_robots", marker="@hookimpl"):
    return f"{HEADER}\n{marker}\ndef {name}():\n    {body}\n"


def environment(id):
    return f"EnvironmentRecord(id={id!r}, summary='s', robot='r', controller='c', max_episode_steps=5)"


def robot_record(**fields):
    fields = {"name": "arm", "summary": "s", "entry_point": "robots:ARM", **fields}
    return f"RobotRecord({', '.join(f'{key}={value!r}' for key, value in fields.items())})"


TASK = "TaskRecord(name={!r}, summary='s', entry_point='tasks:T', environments=({},))"

BROKEN = {
    "syntax error": ("def", "SyntaxError: invalid syntax (broken.py, line 1)"),
    "import error": ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
    "error at import": ("1 / 0", "ZeroDivisionError: division by zero"),
    "error of many lines": ("raise ValueError('one\\ntwo\\nthree')", "ValueError: one"),
    "error without text": ("raise RuntimeError", "RuntimeError"),
    "error that cannot be shown": (
        "class E(Exception):\n    def __str__(self): raise KeyError\nraise E",
        "E",
    ),
    "exit": ("raise SystemExit(3)", "SystemExit: 3"),
    "skipped by a test framework": ("import pytest; pytest.skip('no', allow_module_level=True)", "Skipped: no"),
    "no hooks": ("x = 1", "'broken' has no function with the decorator '@hookimpl'"),
    "marker forgotten": (
        "def frobs_robots(): return []",
        "'frobs_robots' must be a function with the decorator '@hookimpl'",
    ),
    "marked class": (
        HEADER + "@hookimpl\nclass frobs_robots: pass",
        "'frobs_robots' must be a function with the decorator '@hookimpl'",
    ),
    "misspelt hook": (
        hook("return []", "frobs_robot"),
        "there is no hook 'frobs_robot'; did you mean 'frobs_robots'?",
    ),
    "unknown hook": (
        hook("return []", "xyz"),
        "there is no hook 'xyz'; available hooks: "
        "frobs_simulators, frobs_robots, frobs_controllers, frobs_tasks, frobs_algorithms, frobs_extensions",
    ),
    "hook with an argument": (
        HEADER + "@hookimpl\ndef frobs_robots(config): return []",
        "the hook frobs_robots has the parameter 'config'; a hook has no parameters",
    ),
    "hook raises": (hook("raise OSError('no licence')"), "OSError: no licence"),
    "hook exits": (hook("raise SystemExit"), "SystemExit"),
    "generator": (
        hook("yield None"),
        "the hook frobs_robots is a generator; write a plain function that returns a list",
    ),
    "coroutine": (
        HEADER + "@hookimpl\nasync def frobs_robots(): return []",
        "the hook frobs_robots is a coroutine; write a plain function that returns a list",
    ),
    "hook wrapper": (
        hook("return (yield)", marker="@hookimpl(wrapper=True)"),
        "the hook frobs_robots is a generator; write a plain function that returns a list",
    ),
    "return forgotten": (hook("pass"), "frobs_robots returned None; return a list of RobotRecord"),
    "one record without a list": (
        hook(f"return {robot_record()}"),
        "frobs_robots returned a RobotRecord; return a list of RobotRecord",
    ),
    "strings": (hook("return ['arm']"), "frobs_robots returned a str; it may only return RobotRecord"),
    "record of another kind": (
        hook("return [ControllerRecord(name='c', summary='s', entry_point='m:C')]"),
        "frobs_robots returned a ControllerRecord; it may only return RobotRecord",
    ),
    "record with a missing field": (
        hook("return [RobotRecord(name='arm')]"),
        "TypeError: RobotRecord.__init__() missing 2 required keyword-only arguments: 'summary' and 'entry_point'",
    ),
    "duplicate name": (robots("arm", "leg", "arm"), "robot 'arm' is provided twice"),
    "duplicate ID": (
        hook(
            f"return [{TASK.format('a', environment('x/Y-v0'))}, {TASK.format('b', environment('x/Y-v0'))}]",
            "frobs_tasks",
        ),
        "environment ID 'x/Y-v0' is provided twice",
    ),
    "name with capitals": (
        robots("IRB120"),
        "the robot name 'IRB120' is invalid; use only lowercase letters, digits and underscores",
    ),
    "name with a colon": (
        robots("a:b"),
        "the robot name 'a:b' is invalid; use only lowercase letters, digits and underscores",
    ),
    "empty name": (robots(""), "the robot name '' is invalid; use only lowercase letters, digits and underscores"),
    "name that is no string": (
        robots(3),
        "the robot name 3 is invalid; use only lowercase letters, digits and underscores",
    ),
    "entry point without attribute": (
        hook(f"return [{robot_record(entry_point='robots')}]"),
        "robot 'arm': entry_point is 'robots'; it must have the form 'module:attribute'",
    ),
    "summary that is no string": (
        hook(f"return [{robot_record(summary=None)}]"),
        "robot 'arm': summary is None, not a string",
    ),
    "capabilities that are a list": (
        hook(
            "return [SimulatorRecord(name='sim', summary='s', entry_point='m:S', capabilities=['drive'])]",
            "frobs_simulators",
        ),
        "simulator 'sim': capabilities is a list, not a mapping",
    ),
    "level that is a string": (
        hook(
            "return [SimulatorRecord(name='sim', summary='s', entry_point='m:S', capabilities={'drive': 'exact'})]",
            "frobs_simulators",
        ),
        "simulator 'sim': capabilities['drive'] is 'exact'; use a Level, such as Level.EXACT",
    ),
    "names that are a string": (
        hook(
            "return [ModelFormatRecord(name='sdf', summary='s', entry_point='m:R', suffixes='.sdf')]",
            "frobs_extensions",
        ),
        "model_format 'sdf': suffixes is a str, not a tuple",
    ),
    "environments that are a list": (
        hook("return [TaskRecord(name='t', summary='s', entry_point='m:T', environments=[])]", "frobs_tasks"),
        "task 't': environments is a list, not a tuple",
    ),
    "environments that are IDs": (
        hook("return [TaskRecord(name='t', summary='s', entry_point='m:T', environments=('x',))]", "frobs_tasks"),
        "task 't': environments contains a str",
    ),
    "module that replaces itself": (
        "import sys; sys.modules[__name__] = 3",
        "'broken' replaced its module with an int",
    ),
}


def by_name(reports) -> dict[str, PluginReport]:
    return {report.name: report for report in reports}


@pytest.mark.parametrize(("source", "cause"), BROKEN.values(), ids=BROKEN)
def test_a_broken_plugin_is_reported_and_the_others_work(site, caplog, source, cause):
    site.add_robot("a-dist", "good_a", "arm_a")
    site.add("broken-dist", {"broken.py": source}, version="0.3")
    site.add_robot("c-dist", "good_c", "arm_c")
    plugins = site.plugins()
    reports = by_name(plugins.reports())
    assert {name: report.state for name, report in reports.items()} == {
        "good_a": "loaded",
        "broken": "failed",
        "good_c": "loaded",
    }
    broken = reports["broken"]
    assert broken.cause == cause
    assert broken.origin == "broken-dist 0.3"
    assert "Traceback" in broken.traceback
    assert not any(broken.records.values())
    assert list(plugins.records("robot")) == ["arm_a", "arm_c"]
    assert [(r.levelname, r.getMessage()) for r in caplog.records] == [
        ("WARNING", f"plugin 'broken' of broken-dist 0.3 did not load: {cause}")
    ]


@pytest.mark.parametrize(("source", "cause"), BROKEN.values(), ids=BROKEN)
def test_a_broken_plugin_is_an_error_when_strict(site, source, cause):
    site.add("broken-dist", {"broken.py": source}, version="0.3")
    with pytest.raises(PluginLoadError) as raised:
        site.plugins(strict=True).reports()
    assert str(raised.value) == f"plugin 'broken' of broken-dist 0.3 did not load: {cause}"
    assert raised.value.__cause__ is not None


def test_strictness_is_read_from_the_environment(site, monkeypatch):
    site.add("broken-dist", {"broken.py": "1 / 0"})
    monkeypatch.setenv("FROBS_STRICT_PLUGINS", "1")
    with pytest.raises(PluginLoadError, match="division by zero"):
        site.plugins().reports()
    monkeypatch.setenv("FROBS_STRICT_PLUGINS", "0")
    assert site.plugins().reports()[0].state == "failed"


def test_an_interrupt_passes_through_and_loading_can_be_repeated(site):
    site.add("slow-dist", {"slow.py": "raise KeyboardInterrupt"})
    plugins = site.plugins()
    with pytest.raises(KeyboardInterrupt):
        plugins.reports()
    (site.path / "slow.py").write_text(robots("arm_of_the_second_try"))
    assert list(plugins.records("robot")) == ["arm_of_the_second_try"]


def test_every_kind_is_loaded_from_one_plugin_and_its_import_is_timed(site):
    hooks = {
        "simulator": "SimulatorRecord(name='n', summary='s', entry_point='m:X', capabilities={})",
        "robot": "RobotRecord(name='n', summary='s', entry_point='m:X')",
        "controller": "ControllerRecord(name='n', summary='s', entry_point='m:X')",
        "task": "TaskRecord(name='n', summary='s', entry_point='m.n:X.y')",
        "algorithm": "AlgorithmRecord(name='n', summary='s', entry_point='m:X')",
    }
    functions = [f"@hookimpl\ndef frobs_{kind}s(): return [{record}]" for kind, record in hooks.items()]
    site.add("all-dist", {"everything.py": HEADER + "import time; time.sleep(0.01)\n" + "\n".join(functions)})
    plugins = site.plugins()
    (report,) = plugins.reports()
    assert {kind: [record.name for record in records] for kind, records in report.records.items() if records} == {
        kind: ["n"] for kind in hooks
    }
    assert report.import_seconds >= 0.01
    assert all(plugins.get_record(kind, "n") is report.records[kind][0] for kind in hooks)


def test_a_hook_under_another_name_and_one_for_a_later_version_are_understood(site):
    source = hook(f"return [{robot_record()}]", "my_robots", "@hookimpl(specname='frobs_robots')")
    site.add(
        "named-dist", {"named.py": source + hook("return 1 / 0", "frobs_grippers", "@hookimpl(optionalhook=True)")}
    )
    assert list(site.plugins().records("robot")) == ["arm"]


def test_only_the_named_module_is_read_and_its_lazy_attributes_stay_unimported(site):
    site.add(
        "lazy-dist",
        {
            "lazy/__init__.py": robots("lazy_arm")
            + "def __getattr__(name): from lazy import heavy; return heavy.Thing\n"
            + "def __dir__(): return ['frobs_tasks', 'Thing', *globals()]\n",
            "lazy/heavy.py": "raise RuntimeError('imported')",
        },
        points={"lazy": "lazy"},
    )
    assert list(site.plugins().records("robot")) == ["lazy_arm"]
    assert "lazy.heavy" not in sys.modules


def test_a_failed_register_leaves_no_debris(site):
    half = hook(f"return [{robot_record(name='debris')}]", "frobs_robots")
    site.add("half-dist", {"half.py": half + "@hookimpl\ndef frobs_tasks(unknown_argument): return []\n"})
    site.add_robot("z-dist", "good_z", "arm")
    plugins = site.plugins()
    assert list(plugins.records("robot")) == ["arm"]
    assert list(plugins.records("task")) == []


def test_hooks_are_called_once_however_many_threads_ask(site):
    calls = "import sys; sys.frobs_calls = getattr(sys, 'frobs_calls', 0) + 1; import time; time.sleep(0.02)"
    site.add("calls-dist", {"calls.py": hook(f"{calls}; return [{robot_record()}]")})
    plugins = site.plugins()
    seen = []
    threads = [threading.Thread(target=lambda: seen.append(plugins.get_record("robot", "arm"))) for _ in range(8)]
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(seen) == 8
        assert sys.frobs_calls == 1
    finally:
        del sys.frobs_calls


def test_a_plugin_that_asks_for_plugins_while_it_is_imported_is_broken(site):
    site.add("asks-dist", {"asks.py": "import frobs_core.plugins as p; p.records('robot')\n" + robots("arm")})
    with isolated(site.plugins()) as plugins:
        (report,) = plugins.reports()
    assert report.cause == (
        "plugins cannot be looked up while they are being loaded; look them up when your entry_point is used, not when "
        "your plugin is imported"
    )


def test_a_module_that_is_imported_before_frobs_is_loaded_all_the_same(site):
    site.add_robot("first-dist", "first_of_all", "first_arm")
    done = site.python("import first_of_all, frobs_core; print(*frobs_core.plugins.records('robot'))")
    assert done.stderr == ""
    assert "first_arm" in done.stdout.split()


def test_a_slow_import_is_named_on_stderr_while_it_goes_on(site, capsys):
    site.add("slow-dist", {"slow.py": "import time; time.sleep(0.3)\n" + robots("arm")}, version="2.0")
    site.add_robot("quick-dist", "quick", "other")
    plugins = site.plugins(slow_seconds=0.1)
    assert {report.state for report in plugins.reports()} == {"loaded"}
    assert capsys.readouterr().err == (
        "frobs: plugin 'slow' of slow-dist 2.0 is still loading after 0.1 s; "
        "if it does not finish, set FROBS_DISABLE_PLUGINS=slow-dist:slow\n"
    )
    assert not [thread for thread in threading.enumerate() if isinstance(thread, threading.Timer)]


def test_asking_again_after_an_error_when_strict_raises_again(site):
    site.add("broken-dist", {"broken.py": "1 / 0"})
    plugins = site.plugins(strict=True)
    for _ in range(2):
        with pytest.raises(PluginError):
            plugins.records("robot")

"""What ``import frobs_core`` costs and does, in interpreters of their own."""

import json

import pytest

HEAVY = [
    "mujoco",
    "pybullet",
    "torch",
    "stable_baselines3",
    "matplotlib",
    "rospy",
    "rclpy",
    "typer",
    "rich",
    "pydantic",
    "xacro",
    "imageio",
    "scipy",
    "pandas",
    "yaml",
]


def test_importing_the_core_imports_nothing_heavy(site):
    done = site.python("import sys, frobs_core; print(*{name.partition('.')[0] for name in sys.modules})")
    assert done.returncode == 0, done.stderr
    assert not set(HEAVY) & set(done.stdout.split())


def test_fifty_plugins_import_nothing_but_themselves(site):
    for i in range(50):
        site.add_robot(f"dist-{i}", f"plugin_{i}", f"arm_{i}")
    done = site.python("""
        import gymnasium, json, sys
        before = set(sys.modules)
        import frobs_core
        names = [name for name in set(sys.modules) - before if getattr(sys.modules[name], "__spec__", None)]
        print(json.dumps([len(frobs_core.plugins.records("robot")), names]))  # modules of version 0.2 have no spec
    """)
    assert done.stderr == ""
    robots, modules = json.loads(done.stdout)
    assert robots >= 50
    assert sum(name.startswith("plugin_") for name in modules) == 50
    built_in = [name for name in modules if name.startswith("frobs_") and not name.startswith("frobs_core")]
    tiny = {"configuration", "configuration.layout_record"}  # the class of a record of frobs-rl-compat
    tiny |= {"lazy_names"}  # imports the public names of frobs-train when they are used
    assert {name.partition(".")[2] for name in built_in} == {"", "plugin"} | tiny
    assert len(modules) - 50 - len(built_in) <= 85  # the core, pluggy, and what of the standard library they use


def test_a_broken_plugin_costs_an_import_one_line_on_stderr(site):
    site.add("broken-dist", {"broken.py": "import no_such_module"}, version="0.3")
    done = site.python("import frobs_core, gymnasium; print(gymnasium.spec('frobs/Irb120Reach-v0').id)")
    assert done.stdout == "frobs/Irb120Reach-v0\n"
    assert done.stderr == (
        "plugin 'broken' of broken-dist 0.3 did not load: ModuleNotFoundError: No module named 'no_such_module'\n"
    )


def test_a_broken_plugin_stops_the_import_when_strict(site):
    site.add("broken-dist", {"broken.py": "import no_such_module"}, version="0.3")
    done = site.python("import frobs_core", FROBS_STRICT_PLUGINS="1")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        "frobs_core.util.errors.PluginLoadError: plugin 'broken' of broken-dist 0.3 did not load: "
        "ModuleNotFoundError: No module named 'no_such_module'"
    )


def test_a_disabled_plugin_is_not_imported(site):
    site.add("hanging-dist", {"hanging.py": "while True: pass"})
    done = site.python("import frobs_core; print('done')", FROBS_DISABLE_PLUGINS="hanging-dist:hanging")
    assert (done.stdout, done.stderr) == ("done\n", "")


@pytest.mark.parametrize("method", ["spawn", pytest.param("fork", marks=pytest.mark.slow)])
def test_workers_know_the_ids_by_their_self_importing_form_and_say_nothing_twice(site, method):
    site.add("broken-dist", {"broken.py": "1 / 0"})
    done = site.python(f"""
        import multiprocessing, gymnasium

        def work(id):
            return gymnasium.make(id).unwrapped.spec.id

        if __name__ == "__main__":
            import frobs_core
            with multiprocessing.get_context({method!r}).Pool(2) as pool:
                print(pool.map(work, ["frobs_core:frobs/Irb120Reach-v0", "frobs_core:frobs/Irb120ReachGoal-v0"]))
    """)
    assert done.stdout == "['frobs/Irb120Reach-v0', 'frobs/Irb120ReachGoal-v0']\n"
    assert done.stderr == "plugin 'broken' of broken-dist 1.0 did not load: ZeroDivisionError: division by zero\n"


def test_all_kinds_of_trouble_at_once_leave_the_good_ones_working(site):
    core = ("frobs-core>=0.3,<0.4",)
    site.add_robot("good-dist", "good", "good_arm", requires=core)
    site.add_robot("late-dist", "late", "late_arm", requires=("frobs-core>=7,<8",))
    site.add_robot("first-dist", "first", "twofold")
    site.add_robot("second-dist", "second", "twofold")
    site.add("broken-dist", {"broken.py": "1 / 0"}, requires=core)
    site.add("exiting-dist", {"exiting.py": "raise SystemExit"}, requires=core)
    rude = "import os, random, warnings\nprint('hello')\nos.environ['RUDE'] = '1'\nrandom.seed(0)\nraise ImportError('needs a licence')"
    site.add("rude-dist", {"rude.py": rude}, requires=core)
    done = site.python("""
        import frobs_core, gymnasium
        robots = frobs_core.plugins.records("robot")
        print(sorted(name for name in robots if name in ('good_arm', 'late_arm') or 'twofold' in name))
        gymnasium.make("frobs/Irb120Reach-v0").close()
        try:
            frobs_core.plugins.get_record("robot", "twofold")
        except frobs_core.plugins.collection.AmbiguousNameError as error:
            print(error)
    """)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "['first-dist:twofold', 'good_arm', 'late_arm', 'second-dist:twofold']",
        "robot 'twofold' is provided by first-dist 1.0 and by second-dist 1.0; "
        "request 'first-dist:twofold' or 'second-dist:twofold', or uninstall one of them.",
    ]
    told = done.stderr.splitlines()
    told.remove("hello")  # what a plugin prints when it is imported
    assert [line.split("'")[1] for line in told] == ["broken", "exiting", "late", "rude"]


@pytest.mark.slow
def test_fifty_plugins_stay_within_the_budget(site):
    for i in range(50):
        site.add_robot(f"dist-{i}", f"plugin_{i}", f"arm_{i}", requires=("frobs-core>=0.3,<0.4", "numpy>=2"))
    code = """
        import time, gymnasium
        start = time.process_time()
        import frobs_core
        print(time.process_time() - start)
    """
    seconds = min(float(site.python(code).stdout) for _ in range(3))  # of the processor: others may keep it busy
    assert seconds <= 0.3

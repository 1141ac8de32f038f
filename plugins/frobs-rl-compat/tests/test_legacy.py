"""``frobs legacy run`` and ``frobs legacy env``, each as a process of its own, with a real ROS."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import frobs_rl

ROS_PACKAGE = Path(frobs_rl.__file__).parent
FIND = "import {0}; print({0}.__file__)"


def output(command: list[object], code: int = 0, **variables: str) -> str:
    words = [str(word) for word in command]
    done = subprocess.run(words, env={**os.environ, **variables}, capture_output=True, text=True, timeout=60)
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


@pytest.fixture
def script(tmp_path):
    """Write a script and return its file."""

    def write(text: str) -> Path:
        file = tmp_path / "script.py"
        file.write_text(text)
        return file

    return write


def test_a_script_gets_its_own_options_and_returns_its_exit_code(legacy_run, script):
    file = script("import sys; print(sys.prefix, sys.argv[1:]); sys.exit(7)")
    assert output([*legacy_run, file, "--help", "--x", 3], code=7).strip() == f"{sys.prefix} ['--help', '--x', '3']"


@pytest.mark.parametrize(
    "name",
    [
        "gym",
        "rospy",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("rospkg", "tf2_ros", "sensor_msgs.msg", "gazebo_msgs.srv", "frobs_rl")
        ),
    ],
)
def test_what_old_packages_import_is_found_by_a_script_and_by_its_child_processes(legacy_run, script, name):
    code = FIND.format(name)
    file = script(f"{code}\nimport subprocess, sys; subprocess.run([sys.executable, '-c', {code!r}], check=True)")
    first, second = output([*legacy_run, file]).split()
    assert first == second


def test_programs_of_ros_are_on_the_path_without_a_sourced_setup(legacy_run, monkeypatch):
    from frobs_rl_compat import legacy
    from frobs_ros.ros.environment import RosInstallation

    elsewhere = RosInstallation(Path("/opt/ros/noetic"), Path("/opt/ros/noetic/lib/python3/dist-packages"))
    monkeypatch.setattr(legacy, "find_ros", lambda: elsewhere)
    monkeypatch.setenv("PATH", "/usr/bin")
    assert legacy.legacy_variables()["PATH"] == "/usr/bin:/opt/ros/noetic/bin"


OLD_NUMPY = """
from numpy.lib.npyio import save
import numpy as np
from tf.transformations import euler_from_quaternion, quaternion_from_euler
yaw = euler_from_quaternion(quaternion_from_euler(0.0, 0.0, np.array([1.0], np.float32)))[2]
print(np.float(1), np.product([2, 3]), save is np.save, round(yaw, 6))
"""


@pytest.mark.parametrize("python", [sys.executable, "/usr/bin/python3"])
def test_names_and_conversions_that_numpy_has_removed_are_there(legacy_run, script, python):
    assert output([*legacy_run, python, "-W", "ignore", script(OLD_NUMPY)]).strip() == "1.0 6 True 1.0"


def test_the_sitecustomize_of_others_runs_too(legacy_run, script, tmp_path):
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text("import sys; sys.customized = True")
    file = script("import sys; print(sys.customized)")
    assert output([*legacy_run, file], PYTHONPATH=str(tmp_path / "site")).strip() == "True"


def test_a_node_in_the_systems_python_finds_the_messages(legacy_run):
    assert "frobs" in output([*legacy_run, "/usr/bin/python3", "-c", FIND.format("gazebo_msgs.msg")])


def test_frobs_rl_and_gym_of_a_workspace_give_way_and_its_messages_do_not(legacy_run, script, tmp_path):
    for name in ("frobs_rl", "gym", "control_msgs"):
        (tmp_path / "src" / name).mkdir(parents=True)
        (tmp_path / "src" / name / "__init__.py").touch()
    file = script("import frobs_rl.common, gym, control_msgs; print(gym.make.__module__, control_msgs.__file__)")
    with_gym, control = output([*legacy_run, file], PYTHONPATH=str(tmp_path / "src")).split()
    assert with_gym == "frobs_rl_compat.old_gym.registration"
    assert control == str(tmp_path / "src" / "control_msgs" / "__init__.py")


def test_the_environments_own_modules_come_first(legacy_run, script):
    assert str(Path(sys.prefix)) in output([*legacy_run, script(FIND.format("numpy"))])


def test_rospkg_finds_the_ros_package_before_those_of_the_workspace(legacy_run, script):
    file = script("import rospkg; print(rospkg.RosPack().get_path('frobs_rl'), rospkg.RosPack().get_path('rospy'))")
    assert output([*legacy_run, file], ROS_PACKAGE_PATH="/somewhere/else").split() == [
        str(ROS_PACKAGE),
        "/usr/share/rospy",
    ]


def test_ctrl_c_reaches_the_script_and_nothing_else_is_printed(legacy_run, script):
    waits = "    print('ready', flush=True)\n    while True:\n        time.sleep(0.1)"
    handles = "signal.signal(signal.SIGINT, signal.default_int_handler)"  # a background shell ignores SIGINT
    file = script(f"import signal, sys, time\n{handles}\ntry:\n{waits}\nexcept KeyboardInterrupt:\n    sys.exit(3)")
    process = subprocess.Popen([*legacy_run, str(file)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=30) == ("", "")
    assert process.returncode == 3


def test_a_shell_gets_the_same_by_eval_and_a_second_eval_changes_nothing(legacy_run):
    env = " ".join([*legacy_run[:-1], "env"])
    show = f'eval "$({env})" && env | grep -E "^(PYTHON|ROS)" | sort'
    once, twice = output(["sh", "-c", f"{show} && echo - && {show}"], PYTHONPATH="/my folder/it's").split("-\n")
    assert once == twice
    assert "/my folder/it's" in once
    assert f"ROS_PACKAGE_PATH={ROS_PACKAGE}" in once
    assert output([*legacy_run, "sh", "-c", "echo $PYTHONPATH"], PYTHONPATH="/my folder/it's").strip() in once


def test_an_unknown_program_is_an_error(legacy_run):
    assert "neither a Python script" in output([*legacy_run, "no-such-program"], code=2)


def test_without_ros_the_error_names_the_packages_before_the_script_starts(script):
    code = (
        "import pathlib; from frobs_ros.ros import environment; from frobs_cli.program import program\n"
        "environment.SYSTEM = environment.DISTRIBUTION = pathlib.Path('/nowhere')\n"
        f"program()(['legacy', 'run', {str(script('print(1)'))!r}])"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True)
    if done.returncode == 0:
        pytest.skip("not applicable: rospy is installed in this environment")
    assert done.returncode == 2
    assert "apt-get install ros-core" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from frobs_ros.ros import interrupts

_NODE = """
import os, signal, threading, time
from frobs_ros.ros.environment import use_ros
from frobs_ros.ros.interrupts import interruptible

use_ros()
import rospy

signal.signal(signal.SIGINT, signal.default_int_handler)  # a background shell ignores SIGINT
rospy.init_node("trainer")
held = threading.Lock()
rospy.on_shutdown(held.acquire)
with held:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.1)
while not rospy.is_shutdown():
    time.sleep(0.01)
try:
    with interruptible():
        print("it began although the node is gone")
except KeyboardInterrupt:
    print("interrupted")
"""


def test_signal_shuts_the_node_down_although_the_main_thread_holds_a_lock_that_this_needs(second_master: str) -> None:
    process = subprocess.run(
        [sys.executable, "-c", _NODE],
        env={**os.environ, "ROS_MASTER_URI": second_master},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert process.stdout == "interrupted\n", process.stderr
    assert process.stderr == ""


@interrupts.interruptible()
def lose_the_connection(monkeypatch: pytest.MonkeyPatch, interrupted: bool) -> None:
    monkeypatch.setattr(interrupts, "_was_interrupted", interrupted)
    raise OSError("the connection is gone")


def test_signal_that_shut_the_node_down_replaces_the_errors_that_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "_was_interrupted", False)
    with pytest.raises(KeyboardInterrupt):
        lose_the_connection(monkeypatch, interrupted=True)


def test_errors_without_a_signal_are_raised_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OSError, match="gone"):
        lose_the_connection(monkeypatch, interrupted=False)

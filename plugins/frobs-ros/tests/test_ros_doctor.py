from __future__ import annotations

import json
import subprocess
import sys

import pytest

from frobs_ros.ros.doctor import examine_ros
from frobs_ros.ros.environment import PACKAGES


def frobs(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "frobs_cli", *words], capture_output=True, text=True, check=False)


def test_the_doctor_says_what_is_here_and_that_no_master_answers(lonely: str) -> None:
    report = examine_ros()
    assert report.usable
    assert report.master_uri == lonely
    assert not report.master_answers
    found = {part.name: part for part in report.parts}
    assert found["rospy"].found
    assert found["rospy"].version
    assert all(part.package in report.missing for part in report.parts if not part.found and part.package)


def test_the_messages_of_markers_are_a_part_and_named_where_ros_is_missing(ros: None) -> None:
    assert {part.name for part in examine_ros().parts} >= {"visualization_msgs"}
    assert "python3-visualization-msgs" in PACKAGES


def test_the_doctor_sees_a_master(rosmaster: str) -> None:
    assert examine_ros().master_answers


def test_the_doctors_facts_are_json(ros: None) -> None:
    done = frobs("doctor", "ros", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["usable"] is True


def test_a_part_that_is_missing_is_named_with_its_package(ros: None, monkeypatch: pytest.MonkeyPatch) -> None:
    from frobs_ros.ros import doctor

    monkeypatch.setattr(doctor, "PROGRAMS", (*doctor.PROGRAMS, ("rosrobot", "python3-rosrobot", "a part", True)))
    report = doctor.examine_ros()
    assert not report.usable
    assert "python3-rosrobot" in report.missing
    assert any("apt-get install" in line and "python3-rosrobot" in line for line in report.advice)

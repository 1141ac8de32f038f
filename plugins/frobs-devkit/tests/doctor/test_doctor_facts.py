"""Numbers that can be checked by hand."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from tiny_robots import INERTIAL, LIMIT, SOLID, joint, link

from frobs_devkit.doctor import RobotReport, examine_robot
from frobs_devkit.doctor.robot_file import robot_file_text
from frobs_models import ELEMENTS

Examine = Callable[..., RobotReport]


def arm(center: str = "0.1 0 0") -> str:
    return INERTIAL.replace("<mass", f'<origin xyz="{center}"/><mass', 1) + SOLID


def test_a_drive_is_critically_damped_at_its_bandwidth(examine: Examine) -> None:
    report = examine(link("base"), link("arm", arm()), joint("hinge", "base", "arm"))
    drive = report.joints[0].drive
    assert drive is not None
    assert drive.inertia == pytest.approx(0.0042 + 1.0 * 0.1**2)
    assert drive.stiffness == pytest.approx(drive.inertia * (2 * math.pi * drive.bandwidth) ** 2)
    assert drive.damping == pytest.approx(2.0 * math.sqrt(drive.stiffness * drive.inertia))
    assert drive.time_constant == pytest.approx(1.0 / (2 * math.pi * drive.bandwidth))


def test_what_a_joint_must_hold_is_the_lever_of_its_weight(examine: Examine) -> None:
    report = examine(link("base"), link("arm", arm()), joint("hinge", "base", "arm"))
    drive = report.joints[0].drive
    assert drive is not None
    assert drive.holding_effort == pytest.approx(-0.1 * 9.81)  # about +y, with the weight at +x


def test_a_slide_holds_the_weight_itself(examine: Examine) -> None:
    lift = joint("lift", "base", "arm", kind="prismatic").replace("0 1 0", "0 0 1")
    drive = examine(link("base"), link("arm", arm()), lift).joints[0].drive
    assert drive is not None
    assert drive.holding_effort == pytest.approx(9.81)


def test_links_and_joints_are_as_in_the_file(examine: Examine) -> None:
    mimic = '<mimic joint="hinge" multiplier="-2" offset="0.1"/>'
    report = examine(
        link("base"),
        link("arm"),
        link("tool0", ""),
        joint("hinge", "base", "arm"),
        joint("follow", "arm", "tool0", more=LIMIT + mimic),
    )
    hinge, follow = report.joints
    assert (hinge.lower, hinge.upper, hinge.velocity, hinge.effort, hinge.unit) == (-1.0, 1.0, 2.0, 50.0, "rad")
    assert follow.mimic == {"joint": "hinge", "multiplier": -2.0, "offset": 0.1}
    assert follow.home == pytest.approx(0.1)
    assert follow.drive is None
    assert report.links[0].size == pytest.approx((0.1, 0.1, 0.2))
    assert report.links[0].principal_moments == pytest.approx((0.0017, 0.0042, 0.0042))
    assert report.links[2].size is None


def test_the_tool_is_the_link_with_a_tools_name(examine: Examine) -> None:
    report = examine(
        link("base"),
        link("arm"),
        link("end", ""),
        link("tool0", ""),
        joint("hinge", "base", "arm"),
        joint("e", "arm", "end", xyz="0 0 0.5", kind="fixed", more=""),
        joint("t", "arm", "tool0", xyz="0 0 0.4", kind="fixed", more=""),
    )
    assert [tool.link for tool in report.tools] == ["tool0", "end"]
    tool = report.tools[0]
    assert tool.chosen
    assert tool.usual_name
    assert tool.reach == pytest.approx(0.7, abs=0.01)
    assert tool.longest_reach == pytest.approx(0.7)


def test_each_simulator_accounts_for_every_element(examine: Examine) -> None:
    report = examine(link("base"), link("arm"), joint("hinge", "base", "arm"), '<gazebo reference="arm"/>')
    [mujoco] = report.simulators
    assert (mujoco.name, mujoco.builds, mujoco.overlaps) == ("mujoco", True, ())
    rows = {row.element: row for row in mujoco.elements}
    assert set(rows) <= set(ELEMENTS)
    assert rows["inertias"].names == ("base", "arm")
    assert rows["gazebo_tags"].treatment == "dropped"
    assert all(row.how for row in mujoco.elements if row.treatment in ("approximated", "dropped"))
    assert all(row.treatment != "not told" for row in mujoco.elements)


def test_all_installed_simulators_that_are_not_paced_are_asked(examine: Examine) -> None:
    from frobs_core import plugins

    asked = [simulator.name for simulator in examine(simulators=()).simulators]
    assert asked == [name for name, record in plugins.records("simulator").items() if not record.is_paced]


def test_the_irb120_is_healthy() -> None:
    report = examine_robot("frobs_robots_abb:models/irb120.urdf.xacro", simulators=("mujoco",))
    assert report.usable
    assert report.dof == 6
    assert report.tools[0].link == "tool0"
    assert report.tools[0].reach == pytest.approx(0.93, abs=0.02)
    assert report.simulators[0].overlaps == ()
    assert report.differences == ()


def test_an_mjcf_file_is_examined_too(tmp_path: object) -> None:
    path = tmp_path / "arm.xml"  # type: ignore[operator]
    path.write_text(
        '<mujoco model="m"><worldbody><light/><body name="base"><geom type="box" size=".1 .1 .1"/>'
        '<body name="arm" pos="0 0 .3"><joint name="j" range="-90 90" limited="true"/>'
        '<geom type="capsule" size=".03 .1"/><site name="s"/></body></body></worldbody>'
        '<actuator><motor name="m" joint="j"/></actuator></mujoco>'
    )
    report = examine_robot(path, simulators=("mujoco",))
    assert report.usable
    [mujoco] = report.simulators
    assert {"actuators", "sites", "lights"} <= {row.element for row in mujoco.elements}
    assert all(row.treatment != "not told" for row in mujoco.elements)


def test_joints_that_follow_a_passive_joint_have_no_home(tmp_path: object) -> None:
    path = tmp_path / "arm.xml"  # type: ignore[operator]
    bodies = "".join(
        f'<body name="{name}" pos="{x} 0 0"><joint name="{name}" axis="0 0 1"/><geom type="box" size=".01 .01 .01"/></body>'
        for name, x in (("driven", 0.1), ("free", 0.2), ("follower", 0.3))
    )
    path.write_text(
        f'<mujoco model="m"><worldbody><body name="base"><geom type="box" size=".05 .05 .05"/>{bodies}</body></worldbody>'
        '<equality><joint joint1="follower" joint2="free"/></equality>'
        '<actuator><motor name="m" joint="driven" forcerange="-1 1"/></actuator></mujoco>'
    )
    report = examine_robot(path, simulators=("mujoco",))
    assert report.usable
    assert {joint.name: joint.home for joint in report.joints if joint.unit} == {
        "driven": 0.0,
        "free": None,
        "follower": None,
    }
    assert '# home: {"driven": 0.0}' in robot_file_text(report, str(path), {}, path)

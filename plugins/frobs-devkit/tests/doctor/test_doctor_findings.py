"""Each finding is provoked by a tiny robot that has just this wrong."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from tiny_robots import INERTIAL, LIMIT, SOLID, found, joint, link

from frobs_core.util.errors import ModelFileError, UnknownNameError
from frobs_devkit.doctor import RobotReport, Severity

Examine = Callable[..., RobotReport]


ROD = '<collision><geometry><cylinder radius="0.03" length="0.35"/></geometry></collision>'  # along z


def inertial(mass: float, moments: str = 'ixx="0.0042" iyy="0.0042" izz="0.0017"', xyz: str = "0 0 0") -> str:
    return f'<inertial><origin xyz="{xyz}"/><mass value="{mass}"/><inertia {moments}/></inertial>'


def with_arm(content: str, **kwargs: str) -> tuple[str, str, str]:
    return link("base"), link("arm", content), joint("hinge", "base", "arm", **kwargs)


def test_nothing_is_wrong_with_a_plain_robot(examine: Examine) -> None:
    report = examine()
    assert report.usable
    assert report.findings == ()
    assert (report.dof, report.root, report.mass) == (1, "base", 2.0)


@pytest.mark.parametrize(
    ("code", "about", "parts"),
    [
        ("absurd-inertia", "link 'arm'", with_arm(inertial(1.0, 'ixx="1" iyy="1" izz="1"') + SOLID)),
        ("absurd-inertia", "link 'arm'", with_arm(inertial(1.0, 'ixx="1e-7" iyy="1e-7" izz="1e-7"') + SOLID)),
        ("turned-inertia", "link 'arm'", with_arm(inertial(1.0, 'ixx="0.001" iyy="0.01" izz="0.01"') + ROD)),
        ("absurd-mass", "link 'arm'", with_arm(inertial(1000.0, 'ixx="4" iyy="4" izz="2"') + SOLID)),
        ("far-center", "link 'arm'", with_arm(inertial(1.0, xyz="2 0 0") + SOLID)),
        ("visual-only", "link 'arm'", with_arm(INERTIAL + SOLID.replace("collision", "visual"))),
        ("limits-in-degrees", "joint 'hinge'", with_arm(INERTIAL + SOLID, more=LIMIT.replace('"1"', '"170"'))),
        (
            "too-large",
            "link 'arm'",
            with_arm(INERTIAL + SOLID.replace("0.1 0.1 0.2", "100 100 200"), xyz="0 0 300"),
        ),
        (
            "too-weak",
            "joint 'hinge'",
            with_arm(inertial(1.0, xyz="0.1 0 0") + SOLID, more=LIMIT.replace("50", "0.5")),
        ),
        (
            "overlap-at-home",
            "link 'base'",
            (*with_arm(INERTIAL + SOLID), link("tip"), joint("back", "arm", "tip", xyz="0 0 -0.15")),
        ),
        ("impossible-inertia", "link 'arm'", with_arm(inertial(1.0, 'ixx="0.001" iyy="0.001" izz="0.009"') + SOLID)),
        ("zero-mass", "link 'tip'", (*with_arm(INERTIAL + SOLID), link("tip", inertial(0.0)), joint("j", "arm", "tip", kind="fixed", more=""))),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_oddities_are_warnings_with_advice(examine: Examine, code: str, about: str, parts: tuple[str, ...]) -> None:
    report = examine(*parts)
    [finding] = found(report, code)
    assert finding.severity is Severity.WARNING
    assert finding.about == about
    assert finding.problem
    assert finding.advice
    assert report.usable


def test_a_missing_mesh_of_a_collision_shape_is_an_error(examine: Examine) -> None:
    mesh = '<collision><geometry><mesh filename="no.stl"/></geometry></collision>'
    [finding] = found(examine(*with_arm(INERTIAL + SOLID + mesh)), "unresolved-mesh")
    assert finding.severity is Severity.ERROR


def test_the_moment_that_is_too_large_is_named(examine: Examine) -> None:
    moments = 'ixx="0.06" iyy="0.06" izz="0.0001"'
    [finding] = found(examine(*with_arm(inertial(1.0, moments) + SOLID)), "absurd-inertia")
    assert finding.problem.startswith("ixx is 0.06 kg·m², which is 14 times")


def test_a_center_of_mass_inside_the_visual_is_not_far(examine: Examine) -> None:
    partial = SOLID.replace("<geometry>", '<origin xyz="0 0 0.25"/><geometry>')
    assert found(examine(*with_arm(INERTIAL + partial)), "far-center")
    whole = SOLID.replace("collision", "visual")
    assert not found(examine(*with_arm(INERTIAL + partial + whole)), "far-center")


def test_an_assumed_mass_is_not_compared_with_the_shape(examine: Examine) -> None:
    report = examine(*with_arm(SOLID))
    assert [finding.code for finding in report.findings] == ["no-mass"]


def test_several_overlaps_of_two_links_are_one_depth(examine: Examine) -> None:
    tip = link("tip", INERTIAL + SOLID + SOLID.replace("0.1 0.1 0.2", "0.1 0.1 0.1"))
    report = examine(*with_arm(INERTIAL + SOLID), tip, joint("back", "arm", "tip", xyz="0 0 -0.15"))
    [finding] = found(report, "overlap-at-home")
    assert finding.problem.count("mm in mujoco") == 1


def test_no_collision_shape_at_all_is_one_warning(examine: Examine) -> None:
    drawn = INERTIAL + SOLID.replace("collision", "visual")
    report = examine(link("base", drawn), link("arm", drawn), joint("hinge", "base", "arm"))
    assert [finding.code for finding in report.findings] == ["no-collision"]


def test_a_robot_without_joints_cannot_be_used(examine: Examine) -> None:
    report = examine(link("base"))
    [finding] = found(report, "no-joints")
    assert finding.severity is Severity.ERROR
    assert not report.usable


def test_missing_meshes_are_all_found_at_once(examine: Examine) -> None:
    mesh = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
    files = ["no.stl", "package://nowhere/a.stl", "package://nowhere/b.stl"]
    report = examine(link("base"), link("arm", INERTIAL + "".join(map(mesh.format, files))), joint("j", "base", "arm"))
    second, first = found(report, "unresolved-mesh")
    assert (first.about, first.severity) == ("mesh 'no.stl'", Severity.WARNING)  # the robot is only not drawn
    assert "no.stl" in first.problem
    assert (second.about, second.severity) == ("package 'nowhere'", Severity.ERROR)
    assert "2 shapes" in second.problem
    assert "--package-path nowhere=FOLDER" in second.advice
    assert not report.usable
    assert report.joints  # all else is examined all the same


def test_a_mesh_that_is_no_mesh_is_found(examine: Examine, tmp_path: object) -> None:
    (tmp_path / "bad.stl").write_bytes(b"nothing")  # type: ignore[operator]
    report = examine(*with_arm(INERTIAL + '<collision><geometry><mesh filename="bad.stl"/></geometry></collision>'))
    [finding] = found(report, "unreadable-mesh")
    assert "bad.stl" in finding.problem
    [refused] = found(report, "refused")
    assert refused.severity is Severity.ERROR  # no simulator can take it


def test_a_negative_mass_is_an_error_and_the_rest_is_examined(examine: Examine) -> None:
    report = examine(*with_arm(inertial(-1.0) + SOLID))
    assert [finding.about for finding in found(report, "negative-mass")] == ["link 'arm'"]
    assert not report.usable


def test_a_guessed_tool_is_noted(examine: Examine) -> None:
    report = examine(
        link("base"), link("a"), link("b"), joint("ja", "base", "a"), joint("jb", "base", "b", xyz="0 0 -0.3")
    )
    [finding] = found(report, "which-tool")
    assert finding.severity is Severity.NOTE
    assert "'b'" in finding.problem


def test_the_worst_findings_come_first(examine: Examine) -> None:
    report = examine(link("base", inertial(-1.0) + SOLID), link("arm", inertial(1.0, xyz="2 0 0") + SOLID),
                     joint("hinge", "base", "arm"), '<gazebo reference="arm"/>')  # fmt: skip
    severities = [finding.severity for finding in report.findings]
    assert severities == sorted(severities, key=list(Severity).index)
    assert set(severities) == set(Severity)


def test_every_number_that_is_changed_is_a_difference(examine: Examine) -> None:
    report = examine(
        *with_arm(inertial(1.0, 'ixx="0.001" iyy="0.001" izz="0.009"') + SOLID, more=LIMIT.replace('"50"', '"0"'))
    )
    by_quantity = {difference.quantity: difference for difference in report.differences}
    assert set(by_quantity) == {"inertia", "effort limit"}
    assert by_quantity["inertia"].file == [0.001, 0.0, 0.0, 0.001, 0.0, 0.009]
    assert by_quantity["inertia"].used[0] == pytest.approx(0.011 / 3)
    assert (by_quantity["effort limit"].file, by_quantity["effort limit"].used) == (0.0, None)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<robot", "not well-formed XML"),
        ("", "empty"),
        (f'<robot name="r">{link("a")}{link("a")}</robot>', "the name 'a' is already used"),
        (f'<robot name="r">{link("a")}{link("b")}{joint("i", "a", "b")}{joint("j", "a", "b")}</robot>', "loops"),
        (f'<robot name="r">{link("a")}{link("b")}{joint("i", "a", "b")}{joint("j", "b", "a")}</robot>', "cycle"),
    ],
    ids=["broken", "empty", "two of one name", "two parents", "cycle"],
)
def test_a_file_that_cannot_be_read_is_one_clear_error(
    tmp_path: object, examine: Examine, text: str, reason: str
) -> None:
    from frobs_devkit.doctor import examine_robot

    path = tmp_path / "bad.urdf"  # type: ignore[operator]
    path.write_text(text)
    with pytest.raises(ModelFileError, match=reason):
        examine_robot(path)


def test_an_unknown_simulator_is_refused(examine: Examine) -> None:
    with pytest.raises(UnknownNameError, match="mujoco"):
        examine(simulators=("mujoko",))

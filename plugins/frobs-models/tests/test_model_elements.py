from __future__ import annotations

from pathlib import Path

from frobs_core.models import load_model
from frobs_models import ELEMENTS, elements

URDF = """<robot name="r"><material name="wood"><texture filename="wood.png"/></material>
<link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
<visual><geometry><box size="1 1 1"/></geometry><material name="wood"/></visual>
<collision><geometry><sphere radius="1"/></geometry></collision><contact><lateral_friction value="1"/></contact></link>
<link name="b"/><link name="c"/>
<joint name="ab" type="revolute"><parent link="a"/><child link="b"/><dynamics damping="1" friction="2"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/><safety_controller k_velocity="1"/></joint>
<joint name="bc" type="fixed"><parent link="b"/><child link="c"/></joint>
<transmission name="t"/><gazebo reference="a"/><gazebo reference="a"/></robot>"""


def test_a_urdf_tells_which_links_and_joints_have_what(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(URDF)
    found = elements(load_model(path))
    assert list(found) == [kind for kind in ELEMENTS if kind in found]
    by_link = ("inertias", "visual_shapes", "textures", "collision_shapes", "contact_parameters", "gazebo_tags")
    assert all(found.pop(kind)[0] == "a" for kind in by_link)
    assert found.pop("fixed_joints") == ("bc",)
    assert found.pop("transmissions") == ("t",)
    assert set(found) == {
        "moving_joints",
        "position_limits",
        "velocity_limits",
        "effort_limits",
        "joint_damping",
        "joint_friction",
        "safety_controllers",
    }
    assert all(names == ("ab",) for names in found.values())


def test_an_mjcf_tells_what_the_engine_has_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    path.write_text(
        '<mujoco><option timestep="0.01"/><worldbody><geom type="plane" size="1 1 1"/><light/><body name="a">'
        '<geom size=".1"/><body name="b"><joint name="j" armature="1" stiffness="2"/><geom size=".1" contype="0" conaffinity="0"/>'
        '<camera name="c"/></body></body></worldbody><actuator><motor name="m" joint="j"/></actuator></mujoco>'
    )
    found = elements(load_model(path))
    wanted = {"options", "world_geoms", "lights", "collision_shapes", "visual_shapes", "armatures", "joint_springs"}
    assert wanted | {"cameras", "actuators", "moving_joints"} <= set(found)
    assert found["collision_shapes"] == ("a",)
    assert found["visual_shapes"] == ("b",)

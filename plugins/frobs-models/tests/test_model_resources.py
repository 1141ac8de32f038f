from __future__ import annotations

import subprocess
import sys

import pytest

from frobs_core.models import load_model
from frobs_core.util.errors import ModelFileError

URDF = '<robot name="r"><link name="a"/></robot>'


def test_a_path_may_be_relative_and_hold_a_colon(tmp_path, monkeypatch):
    (tmp_path / "my:robot.urdf").write_text(URDF)
    monkeypatch.chdir(tmp_path)
    assert load_model("my:robot.urdf").path == tmp_path / "my:robot.urdf"


def test_a_resource_of_a_package_is_found(tmp_path, monkeypatch):
    (tmp_path / "some_arms" / "models").mkdir(parents=True)
    (tmp_path / "some_arms" / "__init__.py").touch()
    (tmp_path / "some_arms" / "models" / "r.urdf").write_text(URDF)
    monkeypatch.syspath_prepend(tmp_path)
    assert load_model("some_arms:models/r.urdf").name == "r"
    with pytest.raises(ModelFileError, match=r"Did you mean '.*/models/r\.urdf'"):
        load_model("some_arms:models/t.urdf")


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("no_such_package:r.urdf", "the Python package 'no_such_package' is not installed"),
        ("arn.urdf", r"the file does not exist\. Did you mean '.*arm\.urdf'"),
        ("nowhere/deep/arm.urdf", "the file does not exist"),
        ("folder.urdf", "is a folder"),
        ("robot.sdf", r"files with the suffix '\.sdf' are not supported"),
    ],
)
def test_what_is_not_there_is_named(tmp_path, monkeypatch, path, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "robot.sdf").write_text("<sdf/>")
    (tmp_path / "folder.urdf").mkdir()
    with pytest.raises(ModelFileError, match=message):
        load_model(path)


def test_a_package_path_that_is_no_folder_is_refused(tmp_path):
    mesh = '<visual><geometry><mesh filename="package://p/m.stl"/></geometry></visual>'
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r"><link name="a">{mesh}</link></robot>')
    with pytest.raises(
        ModelFileError, match="sets the location of the package 'p' to this path, which is not a folder"
    ):
        load_model(path, package_paths={"p": path})


def test_the_ending_may_lie_about_xml_but_the_first_element_does_not(tmp_path):
    path = tmp_path / "r.xml"
    path.write_text(URDF)
    assert load_model(path).format == "urdf"


def test_importing_the_readers_imports_neither_xacro_nor_an_engine():
    code = "import sys, frobs_core.models; print({'xacro', 'mujoco', 'torch'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A mesh in a package ``arm`` whose folder is called otherwise, and a way to write a file that names it."""
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "GAZEBO_MODEL_PATH"):
        monkeypatch.delenv(variable, raising=False)
    home = tmp_path / "src" / "arm_checkout"
    (home / "meshes").mkdir(parents=True)
    (home / "meshes" / "m.stl").touch()
    (home / "package.xml").write_text("<package><name>arm</name></package>")

    def mesh(uri, where="src/arm_checkout/urdf", **options):
        folder = tmp_path / where
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "r.urdf"
        shape = f'<collision><geometry><mesh filename="{uri}"/></geometry></collision>'
        path.write_text(f'<robot name="r"><link name="a">{shape}</link></robot>')
        return load_model(path, **options).links[0].collisions[0].geometry.path.relative_to(tmp_path).as_posix()

    return mesh


MESH = "src/arm_checkout/meshes/m.stl"


@pytest.mark.parametrize(
    "uri", ["package://arm/meshes/m.stl", "package:///arm/meshes/m.stl", "model://arm/meshes/m.stl"]
)
def test_a_package_xml_above_the_file_names_a_package(packages, uri):
    assert packages(uri) == MESH


def test_relative_paths_and_file_uris_are_found(packages, tmp_path):
    assert packages("../meshes/m.stl") == MESH
    assert packages("file://../meshes/m.stl") == MESH
    assert packages(f"file://{tmp_path / MESH}") == MESH
    assert packages(f"file://localhost{tmp_path / MESH}") == MESH


def test_a_package_is_found_where_the_caller_says(packages, tmp_path):
    given = {"other": tmp_path / "src" / "arm_checkout"}
    assert packages("package://other/meshes/m.stl", "elsewhere", package_paths=given) == MESH


@pytest.mark.parametrize("variable", ["ROS_PACKAGE_PATH", "GAZEBO_MODEL_PATH"])
def test_a_package_is_found_on_the_path_of_ros(packages, tmp_path, monkeypatch, variable):
    monkeypatch.setenv(variable, f"/nowhere:{tmp_path / 'src' / 'arm_checkout'}")
    assert packages("package://arm/meshes/m.stl", "elsewhere") == MESH


def test_a_package_is_found_at_any_depth_below_the_path_of_ros(packages, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert packages("package://arm/meshes/m.stl", "elsewhere") == MESH
    (tmp_path / "src" / "CATKIN_IGNORE").touch()
    with pytest.raises(ModelFileError, match="the ROS package 'arm' is not found"):
        packages("package://arm/meshes/m.stl", "elsewhere")


def test_a_folder_above_the_file_that_is_named_so_counts_at_any_height(packages):
    deep = "src/arm_checkout/a/b/c/d/e"
    assert packages("package://arm_checkout/meshes/m.stl", deep) == MESH


def test_what_is_nowhere_is_refused_with_all_places(packages, tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/opt/ros/share")
    with pytest.raises(ModelFileError, match="the ROS package 'leg' is not found") as caught:
        packages("package://leg/m.stl")
    message = str(caught.value)
    assert "package_paths={'leg': FOLDER}" in message
    assert "/opt/ros/share" in message
    assert str(tmp_path / "src") in message
    with pytest.raises(ModelFileError, match=r"meshes/n\.stl does not exist\..*Did you mean '.*m\.stl'"):
        packages("package://arm/meshes/n.stl")
    with pytest.raises(ModelFileError, match=r"the scheme http:// of 'http://example\.org/m\.stl' is not supported"):
        packages("http://example.org/m.stl")


@pytest.mark.parametrize(
    "uri",
    [
        "package://arm/my%20meshes/m%201.stl",
        "package://arm/my meshes/m 1.stl",
        r"package://arm\my meshes\m 1.stl",
        r"..\my meshes\m 1.stl",
        "file://DIR/my%20meshes/m%201.stl",
        "file://localhost/DIR/my%20meshes/m%201.stl",
    ],
)
def test_other_notations_of_a_path_are_understood(packages, tmp_path, uri):
    (tmp_path / "src/arm_checkout/my meshes").mkdir()
    (tmp_path / "src/arm_checkout/my meshes/m 1.stl").touch()
    assert packages(uri.replace("DIR", str(tmp_path / "src/arm_checkout"))) == "src/arm_checkout/my meshes/m 1.stl"


def test_a_name_with_a_percent_sign_is_taken_as_it_is_written_first(packages, tmp_path):
    (tmp_path / "src/arm_checkout/meshes/a%20b.stl").touch()
    (tmp_path / "src/arm_checkout/meshes/a b.stl").touch()
    assert packages("package://arm/meshes/a%20b.stl") == "src/arm_checkout/meshes/a%20b.stl"


@pytest.mark.parametrize(
    "text",
    [
        "<!-- copied from <name>template</name> --><package><name>My Arm v2.SLDASM</name></package>",
        "<package><author><name>someone</name></author><name>\n My Arm v2.SLDASM </name></package>",
        '<?xml version="1.0"?>\n<package format="3"><name>My Arm v2.SLDASM</name></package>',
    ],
)
def test_the_name_of_a_package_is_that_of_its_manifest(packages, tmp_path, text):
    (tmp_path / "src/arm_checkout/package.xml").write_text(text)
    assert packages("package://My Arm v2.SLDASM/meshes/m.stl") == MESH


@pytest.mark.parametrize(
    "text", ["", "<package>", '<!DOCTYPE a [<!ENTITY n "arm">]><package><name>&n;</name></package>']
)
def test_a_package_without_a_readable_manifest_has_the_name_of_its_folder(packages, tmp_path, text):
    (tmp_path / "src/arm_checkout/package.xml").write_text(text)
    assert packages("package://arm_checkout/meshes/m.stl") == MESH


@pytest.mark.parametrize("uri", ["/opt/vendor/share/arm/meshes/m.stl", "file:///C:/work/share/arm/meshes/m.stl"])
def test_a_path_on_the_machine_of_the_author_is_found_in_the_package(packages, tmp_path, uri):
    given = {"arm": tmp_path / "src/arm_checkout"}
    assert packages(uri, "elsewhere", package_paths=given) == MESH


def test_a_missing_mesh_does_not_list_the_files_around_the_robot(packages, tmp_path):
    (tmp_path / "private.txt").touch()
    with pytest.raises(ModelFileError) as caught:
        packages("meshes/m.stl", ".")
    assert "private" not in str(caught.value)
    assert f"There is no folder {tmp_path / 'meshes'}" in str(caught.value)

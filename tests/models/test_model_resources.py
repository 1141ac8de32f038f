from __future__ import annotations

import subprocess
import sys

import pytest

from frobs_core.errors import ModelFileError
from frobs_core.models import load_model

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
        ("arn.urdf", r"no such file\. Did you mean '.*arm\.urdf'"),
        ("nowhere/deep/arm.urdf", "no such file"),
        ("folder.urdf", "is a folder"),
        ("robot.sdf", r"the ending '\.sdf' is of no model file"),
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
    with pytest.raises(ModelFileError, match="it is no folder"):
        load_model(path, package_paths={"p": path})


def test_the_ending_may_lie_about_xml_but_the_first_element_does_not(tmp_path):
    path = tmp_path / "r.xml"
    path.write_text(URDF)
    assert load_model(path).format == "urdf"


def test_importing_the_readers_imports_neither_xacro_nor_an_engine():
    code = "import sys, frobs_core.models; print({'xacro', 'mujoco', 'torch'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"

from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.models import Box, Sphere, load_model
from frobs_core.util.errors import ModelFileError

HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'


@pytest.fixture
def write(tmp_path: Path):
    def write(inside: str, name: str = "r.urdf.xacro") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(HEAD + inside + "</robot>")
        return path

    return write


def box(size: str) -> str:
    return f'<link name="a"><visual><geometry><box size="{size} 1 1"/></geometry></visual></link>'


def size_of(path: Path, **keywords) -> float:
    geometry = load_model(path, **keywords).links[0].visuals[0].geometry
    assert isinstance(geometry, Box)
    return geometry.size[0]


def test_arguments_reach_the_file(write):
    path = write('<xacro:arg name="size" default="2"/>' + box("${2 * $(arg size)}"))
    assert size_of(path) == 4
    assert size_of(path, xacro_args={"size": "5"}) == 10


def test_a_suffix_in_capitals_is_that_of_a_xacro_file(write):
    path = write('<xacro:arg name="size" default="2"/>' + box("$(arg size)"), "R.URDF.XACRO")
    assert size_of(path, xacro_args={"size": "5"}) == 5


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("${sqrt(16)}", 4),
        ("${math.sqrt(16)}", 4),
        ("${sum_of[1]}", 2),
        ("${max([x * 2 for x in [1, 2, 3]])}", 6),
        ("${python.sum([1, 2])}", 3),
        ("$(eval 2 * 3 + n)", 7),
        ("$(eval ${text})", 8),
        ("$(eval 2 * arg('n'))", 2),
        ("$(eval max(n, min(5, int('7'))))", 5),
        ("$(eval $(arg n) + len((1, 2)))", 3),
        ("$(optenv FROBS_NOWHERE 9)", 9),
    ],
)
def test_expressions_keep_their_meaning(write, expression, value):
    inside = '<xacro:arg name="n" default="1"/><xacro:property name="sum_of" value="${[1, 2]}"/>'
    inside += """<xacro:property name="text" value="2 * max(3, arg('n') + 3)"/>""" + box(expression)
    assert size_of(write(inside)) == value


@pytest.mark.parametrize(
    "element",
    [
        '<xacro:element xacro:name="${name}" size="2 1 1"/>',
        '<xacro:element xacro:name="box"><xacro:attribute name="size" value="${2} 1 1"/></xacro:element>',
        '<xacro:element xacro:name="sphere"><xacro:attribute name="radius" value="${1/2}"/></xacro:element>',
        '<sphere><xacro:attribute name="radius" value="${0.5}"/></sphere>',
        '<xacro:half what="radius"/>',
    ],
)
def test_elements_and_attributes_can_be_computed(write, element):
    macro = """<xacro:macro name="half" params="what"><sphere>
        <xacro:attribute name="${what}" value="${1/2}"/></sphere></xacro:macro>"""
    text = f'<link name="a"><visual><geometry>{element}</geometry></visual></link>'
    model = load_model(write('<xacro:property name="name" value="box"/>' + macro + text))
    geometry = model.links[0].visuals[0].geometry
    assert geometry in (Box((2, 1, 1)), Sphere(0.5))


def test_macros_includes_and_conditions_work(write):
    write(
        '<xacro:macro name="cube" params="size flag:=true"><xacro:if value="${flag}">'
        + box("${size}")
        + "</xacro:if></xacro:macro>",
        "parts/cube.xacro",
    )
    assert size_of(write('<xacro:include filename="parts/cube.xacro"/><xacro:cube size="3"/>')) == 3
    assert size_of(write('<xacro:include filename="$(dirname)/parts/cube.xacro"/><xacro:cube size="3"/>')) == 3
    optional = '<xacro:include filename="nowhere.xacro" optional="true"/>'
    assert size_of(write(optional + box("2"))) == 2


def package(folder: Path, name: str, xml: bool = True) -> Path:
    folder.mkdir(parents=True)
    if xml:
        (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (folder / "size.xacro").write_text(HEAD + '<xacro:property name="size" value="7"/></robot>')
    return folder


FIND = '<xacro:include filename="$(find my_pkg)/size.xacro"/>' + box("${size}")


def test_find_looks_in_the_folders_given(write, tmp_path):
    package(tmp_path / "elsewhere" / "folder", "my_pkg", xml=False)
    assert size_of(write(FIND, "a/r.xacro"), package_paths={"my_pkg": tmp_path / "elsewhere" / "folder"}) == 7


def test_find_looks_in_ros_package_path(write, tmp_path, monkeypatch):
    package(tmp_path / "ws" / "src" / "my_pkg", "my_pkg")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path / 'ws' / 'src'}")
    assert size_of(write(FIND, "a/b/c/d/r.xacro")) == 7


@pytest.mark.parametrize("folder", ["my_pkg", "renamed"])
def test_find_looks_above_the_file(write, tmp_path, folder):
    package(tmp_path / folder, "my_pkg")
    assert size_of(write(FIND, f"{folder}/urdf/deep/r.xacro")) == 7


def test_find_looks_beside_the_files_own_package(write, tmp_path):
    package(tmp_path / "src" / "my_pkg", "my_pkg")
    package(tmp_path / "src" / "mine", "mine")
    assert size_of(write(FIND, "src/mine/urdf/r.xacro")) == 7


def test_meshes_are_found_in_packages_after_expansion(write, tmp_path):
    mesh = package(tmp_path / "my_pkg", "my_pkg") / "m.stl"
    mesh.write_bytes(b"solid")
    inside = '<link name="a"><visual><geometry><mesh filename="{}"/></geometry></visual></link>'
    for uri in ("package://my_pkg/m.stl", "file://$(find my_pkg)/m.stl", "model://my_pkg/m.stl"):
        model = load_model(write(inside.format(uri)))
        assert model.links[0].visuals[0].geometry.path == mesh


BAD = {
    "unknown argument": ('<xacro:arg name="size" default="1"/>', {"sise": "1"}, "Did you mean 'size'"),
    "argument without a value": (box("$(arg size)"), {}, "xacro_args={'size': VALUE}"),
    "unknown macro parameter": (
        '<xacro:macro name="m" params="length"/><xacro:m lenght="1"/>',
        {},
        "the macro 'm' has no parameter 'lenght'. Did you mean 'length'",
    ),
    "macro parameter left out": (
        '<xacro:macro name="m" params="p q"/><xacro:m p="1"/>',
        {},
        "a call to the macro 'm' does not set the required parameters q",
    ),
    "unknown macro": ('<xacro:macro name="wheel"/><xacro:wheal/>', {}, "Did you mean 'wheel'"),
    "unknown property": (
        '<xacro:property name="radius" value="1"/>\n' + box("${radios}"),
        {},
        "xacro:3: the property 'radios' is not defined. Did you mean 'radius'",
    ),
    "unknown package": (FIND, {}, "the ROS package 'my_pkg' is not found"),
    "missing include": ('<xacro:include filename="no.xacro"/>', {}, "No such file"),
    "nonsense expression": (box("${1 +}"), {}, "1 +"),
    "endless macro": ('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>', {}, "infinite recursion"),
    "condition that is none": ('<xacro:if value="perhaps"/>', {}, "perhaps"),
}


@pytest.mark.parametrize(("inside", "arguments", "message"), BAD.values(), ids=BAD.keys())
def test_bad_xacro_is_refused_by_one_clear_line(write, inside, arguments, message):
    path = write(inside)
    with pytest.raises(ModelFileError) as caught:
        load_model(path, xacro_args=arguments)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_an_included_file_is_named_when_it_is_broken_or_a_bomb(write, tmp_path):
    path = write('<xacro:include filename="part.xacro"/>')
    for text, message in [("<robot>\n<a></robot>", "part.xacro:2: not well"), ("<!DOCTYPE a []><a/>", "document type")]:
        (tmp_path / "part.xacro").write_text(text)
        with pytest.raises(ModelFileError, match=message):
            load_model(path)


def test_arguments_for_a_file_that_takes_none_are_refused(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text('<robot name="r"><link name="a"/></robot>')
    with pytest.raises(ModelFileError, match="cannot use xacro arguments"):
        load_model(path, xacro_args={"a": "1"})


@pytest.mark.parametrize(
    "expression",
    [
        "${().__class__}",
        "${(lambda: ().__class__)()}",
        "${[x.__class__ for x in [1]]}",
        "${(x for x in [1]).gi_frame}",
        "${'{0.__class__}'.format(1)}",
        "${python.vars(1)}",
        "${open('PATH', 'w')}",
        "$(eval ${text})",
    ],
)
def test_expressions_cannot_leave_their_fence(write, tmp_path, expression):
    target = tmp_path / "written"
    inside = """<xacro:property name="text" value="open('PATH', 'w')"/>""" + box(expression)
    with pytest.raises(ModelFileError):
        load_model(write(inside.replace("PATH", str(target))))
    assert not target.exists()


def test_a_failure_leaves_xacro_as_it_was(write):
    import xacro

    before = dict(vars(xacro))
    with pytest.raises(ModelFileError):
        load_model(write(box("${nothing}")))
    assert dict(vars(xacro)) == before
    assert size_of(write(box("3"))) == 3

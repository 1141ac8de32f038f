"""What one xacro file does to its names changes no other file."""

from __future__ import annotations

import threading
from itertools import product

import pytest
import yaml

from frobs_core.models import Box, load_model
from frobs_core.util.errors import ModelFileError

VICTIM = (
    '<link name="a"><visual><geometry>'
    '<box size="${pi} ${math.sqrt(16)} ${len([1, 2]) + python.abs(-1) + int(1)}"/>'
    "</geometry></visual></link>"
)
SIZE = (3.141592653589793, 4.0, 4.0)

TABLES = ["python", "math", "xacro", "ns.root", "ns.parent", "ns.parent.parent", "ns.python", "ns.root['math']"]
CHANGES = [
    "update(pi=3, len=float, abs=float, sqrt=float, load_yaml=float)",
    "update(dict(pi=3, len=float, abs=float, sqrt=float))",
    "setdefault('pi', 3)",
    "clear()",
    "pop('sqrt')",
    "pop('pi', None)",
    "popitem()",
    "__setitem__('pi', 3)",
    "__init__(pi=3)",
    "_setitem('pi', 3, unevaluated=False)",
]


@pytest.fixture
def victim(write):
    return write(VICTIM, "victim.urdf.xacro")


def size_of(path) -> tuple[float, float, float]:
    geometry = load_model(path).links[0].visuals[0].geometry
    assert isinstance(geometry, Box)
    return geometry.size


@pytest.mark.parametrize("expression", [f"{table}.{change}" for table, change in product(TABLES, CHANGES)])
def test_no_expression_changes_a_table(write, victim, expression):
    write("", "ns.xacro")
    attack = write(f'<xacro:include filename="ns.xacro" ns="ns"/><link name="${{{expression}}}"/>')
    with pytest.raises(ModelFileError):
        load_model(attack)
    assert size_of(victim) == SIZE


@pytest.mark.parametrize(
    "inside",
    [
        '<xacro:property name="pi" value="3"/>',
        '<xacro:property name="pi" value="3" scope="global"/>',
        '<xacro:property name="math" value="3"/>',
        '<xacro:property name="len" value="${float}"/>',
        '<xacro:property name="pi" remove="true"/>',
        '<xacro:macro name="m"><xacro:property name="pi" value="3" scope="parent"/></xacro:macro><xacro:m/>',
        '<xacro:macro name="m"><xacro:property name="pi" value="3" scope="global"/></xacro:macro><xacro:m/>',
        '<xacro:include filename="empty.xacro" ns="math"/>',
        '<xacro:include filename="empty.xacro" ns="python"/>',
        '<xacro:arg name="pi" default="3"/>',
        '<xacro:property name="y" value="${xacro.load_yaml(\'u.yaml\')}"/>',
    ],
)
def test_a_property_of_one_file_is_unknown_to_another(write, victim, tmp_path, inside):
    write("", "empty.xacro")
    (tmp_path / "u.yaml").write_text("angle: !degrees 180")
    known = dict(yaml.SafeLoader.yaml_constructors)  # the real rosparam, if a test has imported it, knows !degrees too
    load_model(write(inside + '<link name="a"/>'))
    assert size_of(victim) == SIZE
    assert yaml.SafeLoader.yaml_constructors == known


def test_arguments_and_macros_of_one_file_are_unknown_to_another(write):
    load_model(write('<xacro:arg name="a" default="1"/><xacro:macro name="m"/><link name="a"/>'))
    for inside in ('<link name="$(arg a)"/>', "<xacro:m/>"):
        with pytest.raises(ModelFileError):
            load_model(write(inside, "other.urdf.xacro"))


def test_files_are_expanded_in_several_threads_at_once(write, victim):
    found: list[object] = []

    def load(path) -> None:
        for _ in range(5):
            found.append(size_of(path))

    others = [write(VICTIM.replace("${pi}", str(i)), f"r{i}.urdf.xacro") for i in range(1, 4)]
    threads = [threading.Thread(target=load, args=(path,)) for path in (victim, *others)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(set(found)) == sorted([SIZE, *((float(i), 4.0, 4.0) for i in range(1, 4))])

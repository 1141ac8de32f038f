from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.models import load_model
from frobs_core.util.errors import ModelFileError
from frobs_models import fingerprint

MESH = (
    "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n"
)
TEXT = """<robot name="one">
  <link name="a"><collision><geometry><mesh filename="part.stl"/></geometry></collision></link>
  <link name="b"/>
  <joint name="turn" type="revolute">
    <parent link="a"/><child link="b"/><origin xyz="0.1 0 -0"/>
    <limit lower="-1" upper="1" velocity="2" effort="3"/>
  </joint>
</robot>
"""


def written(folder: Path, text: str = TEXT, mesh: str = MESH) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "part.stl").write_text(mesh)
    (folder / "robot.urdf").write_text(text)
    return fingerprint(load_model(folder / "robot.urdf"))


def test_it_is_the_same_wherever_the_file_lies_and_however_it_is_written(tmp_path: Path) -> None:
    first = written(tmp_path / "here")
    assert len(first) == 64
    assert written(tmp_path / "there") == first
    assert written(tmp_path / "said", TEXT.replace("0.1 0 -0", "0.10  0.0 0").replace('"one"', '"two"')) == first


@pytest.mark.parametrize(
    ("old", "new"),
    [("0.1 0", "0.11 0"), ('lower="-1"', 'lower="-2"'), ('velocity="2"', 'velocity="3"'), ("turn", "twist")],
)
def test_what_moves_otherwise_has_another(old: str, new: str, tmp_path: Path) -> None:
    assert written(tmp_path / "other", TEXT.replace(old, new)) != written(tmp_path / "one")


def test_a_mesh_counts_by_what_is_in_it(tmp_path: Path) -> None:
    assert written(tmp_path / "other", mesh=MESH.replace("1 0 0\n", "2 0 0\n")) != written(tmp_path / "one")


def test_a_mesh_that_has_gone_is_named(tmp_path: Path) -> None:
    written(tmp_path / "one")
    model = load_model(tmp_path / "one" / "robot.urdf")
    (tmp_path / "one" / "part.stl").unlink()
    with pytest.raises(ModelFileError, match=r"part\.stl"):
        fingerprint(model)

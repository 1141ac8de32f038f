"""Records that are not one of the five kinds: the hook ``frobs_extensions``, and the hooks of version 0.2."""

from __future__ import annotations

import pytest

from frobs_core import plugins
from frobs_core.deprecation import FrobsDeprecationWarning
from frobs_core.kernel.robot_config import RobotConfig
from frobs_core.models import is_model_file, load_model
from frobs_core.util.errors import ModelFileError

HEADER = """
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import *
"""

OWN_KIND = """
@dataclass(frozen=True, kw_only=True)
class DialectRecord(Record):
    kind: ClassVar[str] = "dialect"
    letters: int = 26
"""

SHAPES = """
from pathlib import Path
from frobs_core.contracts import ModelReader
from frobs_core.models import Link, RobotModel

class Reader(ModelReader):
    def read(self, path, *, xacro_args=None, package_paths=None):
        return RobotModel(name=Path(path).read_text(), path=Path(path), format="shape", xml="", links=(Link("base"),), joints=())

    def lowest_points(self, model, joint_positions, quat_wxyz):
        return {}
"""


def extensions(*records):
    """Return the source of a plugin that offers extensions."""
    imports = "from dataclasses import dataclass\nfrom typing import ClassVar\n"
    return f"{imports}{HEADER}{OWN_KIND}\n@hookimpl\ndef frobs_extensions():\n    return [{', '.join(records)}]\n"


def test_the_class_of_a_record_is_its_kind(site):
    wind = "CapabilityRecord(name='wind', summary='s', methods=('wind_velocity',))"
    site.add(
        "wind-dist", {"wind.py": extensions(wind, "ParameterRecord(name='speed', summary='s', capability='wind')")}
    )
    offered = site.plugins()
    assert [*offered.records("capability")] == ["wind"]
    assert [*offered.records("parameter")] == ["speed"]
    assert offered.records("sensor_type") == {}


def test_a_plugin_may_define_a_kind_of_its_own(site):
    site.add("talk-dist", {"talk.py": extensions("DialectRecord(name='low', summary='s', entry_point='a:b')")})
    assert site.plugins().get_record("dialect", "low").letters == 26


@pytest.mark.parametrize(
    ("record", "reason"),
    [
        (
            "RobotRecord(name='arm', summary='s', entry_point='a:b')",
            "returned a RobotRecord; it returns extensions, such as",
        ),
        ("Record(name='arm', summary='s', entry_point='a:b')", "returned a Record; it returns extensions, such as"),
        ("None", "returned None; it may only return Record"),
        ("DialectRecord(name='low', summary='s', entry_point='')", "dialect 'low': entry_point is ''"),
    ],
)
def test_what_is_not_an_extension_is_refused(site, record, reason):
    site.add("bad-dist", {"bad.py": extensions(record)})
    (report,) = site.plugins().reports()
    assert report.state == "failed"
    assert reason in report.cause


def test_a_hook_of_0_2_still_works_and_says_what_replaces_it(site, monkeypatch):
    monkeypatch.delenv("FROBS_DEPRECATIONS")
    hook = "@hookimpl\ndef frobs_abilities():\n    return [CapabilityRecord(name='wind', summary='s')]\n"
    site.add("old-dist", {"old.py": HEADER + hook})
    with pytest.warns(FrobsDeprecationWarning, match="frobs_abilities of 'old-dist:old'.*use frobs_extensions"):
        assert [*site.plugins().records("capability")] == ["wind"]


def test_a_plugin_may_add_a_format_of_model_files(site, tmp_path):
    record = "ModelFormatRecord(name='shape', summary='s', suffixes=('.shape',), entry_point='shapes:Reader')"
    site.add(
        "shape-dist", {"shape_plugin.py": extensions(record), "shapes.py": SHAPES}, points={"shape": "shape_plugin"}
    )
    (tmp_path / "ball.shape").write_text("ball")
    with plugins.isolated(site.plugins()):
        assert load_model(tmp_path / "ball.shape").name == "ball"
        assert is_model_file("ball.SHAPE")
        assert not is_model_file("arm.urdf")
        assert RobotConfig(robot=str(tmp_path / "ball.shape")).describe().name == "ball"  # a file, not a name
        with pytest.raises(
            ModelFileError, match=r"arm.urdf: robot files with the suffix '.urdf' are not supported; use one of .shape"
        ):
            load_model("arm.urdf")


def test_without_a_reader_the_error_says_what_to_install(site):
    with (
        plugins.isolated(site.plugins()),
        pytest.raises(
            ModelFileError, match=r"no installed plugin reads robot files. To install one: pip install .*frobs-models"
        ),
    ):
        load_model("arm.urdf")

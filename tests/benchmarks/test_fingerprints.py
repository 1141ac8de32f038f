from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import fingerprints
import tasks

PUSH = "frobs/PandaPush-v0"


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the files that define a row, as the only commit of a repository."""
    for path in fingerprints.defining_files(PUSH, "dagger"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(fingerprints.ROOT / path, tmp_path / path)
    files = fingerprints.defining_files(PUSH, "dagger")
    monkeypatch.setattr(fingerprints, "ROOT", tmp_path)
    monkeypatch.setattr(fingerprints, "defining_files", lambda *_: files)
    for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "copy"]):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *command], cwd=tmp_path, check=True)
    return tmp_path


def test_the_files_of_task_robot_controller_expert_and_settings_define_a_row() -> None:
    names = {Path(path).name for path in fingerprints.defining_files(PUSH, "dagger")}
    assert names == {
        *("manipulation.py", "push.py", "panda.py", "panda_arm.urdf.xacro"),
        *("tcp_delta_pose.py", "dagger_long.yaml"),
    }
    reach = {
        Path(path).name for path in fingerprints.defining_files("frobs/Irb120Reach-v0", "ppo", "tcp_delta_position")
    }
    assert {"start.py", "tcp_delta_position.py", "irb120.urdf.xacro", "parts.xacro"} < reach
    assert "irb140.urdf.xacro" not in reach


@pytest.mark.parametrize(
    ("name", "before", "after", "is_changed"),
    [
        ("push.py", '    """', '    """Another docstring. ', False),
        ("push.py", "import annotations", "import annotations  # a comment", False),
        ("push.py", "0.", "1.", True),
        ("dagger_long.yaml", "steps:", "# a comment\nsteps:", False),
        ("dagger_long.yaml", "steps: ", "steps: 1", True),
        ("panda_arm.urdf.xacro", "0.", "1.", True),
    ],
)
def test_a_row_is_marked_if_a_file_that_defines_it_changed(
    copied: Path, name: str, before: str, after: str, is_changed: bool
) -> None:
    measured = fingerprints.fingerprint(PUSH, "dagger")
    path = copied / max(path for path in measured if path.endswith(f"/{name}"))  # not the expert's file
    text = path.read_text("utf-8")
    assert before in text
    path.write_text(text.replace(before, after, 1), "utf-8")
    rows = [{"files": measured}]
    current = fingerprints.fingerprint(PUSH, "dagger")
    assert fingerprints.mark(rows, current) == ("†" if is_changed else "")
    notes = fingerprints.footnotes({"a row": (rows, current)})
    assert notes == (["", f"† These files changed after the measurement: a row ({name})."] if is_changed else [])


def test_the_page_marks_rows_that_changed_or_are_unknown() -> None:
    found = {"success_rate": 0.9, "success_interval": [0.8, 1.0], "mean_reward": 1.0, "mean_length": 50.0}
    row = {"seed": 0, "steps": 1, "seconds": 1.0, "machine": "a", "commit": "abc", "mujoco": found, "pybullet": None}
    case = tasks.Case(PUSH, "dagger")
    current = case.fingerprint
    old = {**current, next(path for path in current if path.endswith("/panda.py")): "0"}
    for files, shown, note in (
        ({"files": current}, "", None),
        ({"files": old}, " †", f"† These files changed after the measurement: `{PUSH}` (panda.py)."),
        ({}, " ‡", f"settings changed after the measurement: `{PUSH}`."),
    ):
        page = tasks.report({case: [{**row, **files}]}, {}, 1000)
        assert f"| [`{PUSH}`](#frobspandapush-v0){shown} | `dagger`" in page
        assert note is None or note in page


def test_fingerprints_of_existing_rows_come_from_their_commits(copied: Path, tmp_path: Path) -> None:
    measured = fingerprints.fingerprint(PUSH, "dagger")
    record = tmp_path / "rows.json"
    rows = [{"commit": "HEAD"}, {"commit": "HEAD+"}, {"commit": "0000000"}, {"commit": "HEAD", "files": {"a": "b"}}]
    record.write_text(json.dumps(rows), "utf-8")
    fingerprints.add_fingerprints(record, lambda row: [*measured, "none.py"])
    found = [row.get("files") for row in json.loads(record.read_text("utf-8"))]
    assert found == [{**measured, "none.py": ""}, None, None, {"a": "b"}]

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import behavior

ID = "frobs/Irb120Reach-v0"


@pytest.mark.slow
def test_the_same_version_behaves_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, chosen = tmp_path / "behavior.json", ["--only", ID, "--simulator", "mujoco"]
    behavior.main(["record", str(file), *chosen])
    cases = json.loads(file.read_text("utf-8"))["digests"]
    assert list(cases) == [f"{ID} mujoco single", f"{ID} mujoco vector"]
    assert all(len(values) == 6 for values in cases.values())
    with pytest.raises(SystemExit) as end:
        behavior.main(["compare", str(file), *chosen])
    assert end.value.code == 0
    assert "2 cases of 300 steps: identical." in capsys.readouterr().out


def test_the_first_difference_is_named() -> None:
    recorded = {"a": ["0", "1", "2"], "b": ["0"], "c": ["0"]}
    lines = behavior.compare(recorded, {"a": ["0", "x", "y"], "b": ["0"], "d": ["0"]})
    assert lines == ["a: differs within steps 51 to 100", "c: missing"]


def test_every_kind_of_difference_changes_the_digest() -> None:
    def digest(value: object) -> str:
        found = behavior.hashlib.sha256()
        behavior.update(found, value)
        return found.hexdigest()

    values = [1.0, 1, True, None, [1.0, 1.0], {"a": 1.0}, {"b": 1.0}, {"a": 1.0 + 1e-15}]
    assert len({digest(value) for value in values}) == len(values)

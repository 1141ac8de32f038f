from __future__ import annotations

import math
from pathlib import Path

import pytest

from frobs_core.util.errors import RunError
from frobs_train.logs.progress import STEPS, ProgressLog, read_progress


def test_rows_are_there_at_once(tmp_path: Path) -> None:
    with ProgressLog(tmp_path) as log:
        log.write({STEPS: 10, "episode/reward": None})
        log.write({STEPS: 20, "episode/reward": 1.5})
        columns = read_progress(tmp_path / "progress.csv")
    assert columns[STEPS] == [10, 20]
    assert math.isnan(columns["episode/reward"][0])
    assert columns["episode/reward"][1] == 1.5


def test_a_new_name_becomes_a_column_under_one_header(tmp_path: Path) -> None:
    with ProgressLog(tmp_path) as log:
        log.write({STEPS: 10, "a": 1.0})
        log.write({STEPS: 20, "a": 2.0, "b": 3.0})
        log.write({STEPS: 30, "b": 4.0})
    lines = (tmp_path / "progress.csv").read_text().splitlines()
    assert lines == [f"{STEPS},a,b", "10,1,", "20,2,3", "30,,4"]


def test_a_line_that_a_kill_cut_short_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "progress.csv").write_text(f"{STEPS},a\n10,1\n20,")
    assert read_progress(tmp_path / "progress.csv") == {STEPS: [10.0], "a": [1.0]}


def test_tensorboard_gets_the_same(tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

    with ProgressLog(tmp_path) as log:
        log.write({STEPS: 10, "episode/reward": 1.5, "episode/success": None})
    (file,) = (tmp_path / "tensorboard").iterdir()
    found = [
        (event.step, value.tag, value.tensor.float_val[0])
        for event in EventFileLoader(str(file)).Load()
        for value in event.summary.value
    ]
    assert found == [(10, STEPS, 10.0), (10, "episode/reward", 1.5)]


@pytest.mark.parametrize("content", [b"\xff\xfe\x00garbage\n\x81\n", b"a,b\n1,x\n", b"a,b\n1,2,3\n"])
def test_garbage_is_an_error_that_names_the_file(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "progress.csv").write_bytes(content)
    with pytest.raises(RunError, match=r"progress\.csv is damaged: .* Remove the file"):
        read_progress(tmp_path / "progress.csv")

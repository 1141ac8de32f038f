from __future__ import annotations

from pathlib import Path

import pytest

from frobs_core.util.errors import ConfigFileError, ConfigurationError
from frobs_core.util.validation import positive
from frobs_tasks_legacy.yaml import TaskFiles


def read(folder: Path, *texts: str, **keywords: object) -> dict[str, object]:
    paths = [folder / f"task_{i}.yaml" for i in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text, "utf-8")
    used = {"size": positive, "speed": positive}
    files = TaskFiles(folder="", kind="", roots={}, used=used, ignored=["colour"])
    return files.read_files(paths, "robot", keywords)


def test_what_means_something_is_read_and_the_rest_passed_over(tmp_path: Path) -> None:
    assert read(tmp_path, "robot:\n  size: 2\n  colour: red\n") == {"size": 2.0}


def test_a_later_file_goes_before_an_earlier_one_and_a_keyword_before_both(tmp_path: Path) -> None:
    texts = ("robot: {size: 1, speed: 1}", "robot: {size: 2}")
    assert read(tmp_path, *texts, speed=None) == {"size": 2.0, "speed": 1.0}
    assert read(tmp_path, *texts, size=3) == {"size": 3.0, "speed": 1.0}
    with pytest.raises(ConfigurationError, match="size is -1"):
        read(tmp_path, *texts, size=-1)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("robot:\n  syze: 2\n", 2, "unknown key 'syze'. Did you mean 'size'.*colour"),
        ("robot:\n  colour: red\n  size: -2\n", 3, "size is -2"),
        ("robots:\n  size: 2\n", 1, "must contain 'robot:'"),
        ("robot: 2\n", 1, "must contain a mapping under 'robot:'"),
    ],
)
def test_mistakes_are_told_with_file_and_line(tmp_path: Path, text: str, line: int, message: str) -> None:
    with pytest.raises(ConfigFileError, match=message) as failure:
        read(tmp_path, text)
    assert failure.value.line == line

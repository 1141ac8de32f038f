from __future__ import annotations

import math
import time
from pathlib import Path

import pytest

from frobs_core.util.errors import ConfigFileError
from frobs_core.util.yaml import dump_yaml, find_origin, load_yaml, load_yaml_text, load_yaml_value, merge


def refused(text: str) -> ConfigFileError:
    with pytest.raises(ConfigFileError) as caught:
        load_yaml_text(text, "config.yaml")
    return caught.value


def test_values_come_as_they_are_written() -> None:
    text = "a: 1\nb: 1e-4\nc: .5\nd: [x, true, null]\ne: {f: 2020-01-01}\ng: 500_000\nh: 'yes'\n"
    assert load_yaml_text(text) == {
        "a": 1,
        "b": 1e-4,
        "c": 0.5,
        "d": ["x", True, None],
        "e": {"f": "2020-01-01"},
        "g": 500_000,
        "h": "yes",
    }


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        pytest.param("a:\n\tb: 1\n", 2, "tab", id="tab"),
        pytest.param("a: 1\nb: 2\na: 3\n", 3, "is already set on line 1", id="duplicate key"),
        pytest.param("a:\n  b: 1\n  b: 1\n", 3, "is already set on line 2", id="nested duplicate key"),
        pytest.param("- 1\n- 2\n", 1, "does not have a mapping", id="list"),
        pytest.param("hello", 1, "does not have a mapping", id="text"),
        pytest.param("", None, "is empty", id="empty"),
        pytest.param("# nothing\n", None, "is empty", id="comment"),
        pytest.param("a: [1, 2\nb: 3\n", 2, "not valid YAML", id="unclosed list"),
        pytest.param("a: 1\n---\nb: 2\n", 2, "not valid YAML", id="two documents"),
        pytest.param("a: 1\n1: 2\n", 2, "is not a string", id="number as key"),
        pytest.param("a: 1\non: 2\n", 2, "put quotes", id="boolean as key"),
        pytest.param("? [a]\n: 1\n", 1, "is not a string", id="list as key"),
        pytest.param("a: !!binary aGk=\n", 1, "'!!binary' is not supported", id="binary"),
        pytest.param("a: !mine 3\n", 1, "'!mine' is not supported", id="own tag"),
        pytest.param("a: &x {b: 1}\nc:\n  <<: *x\n", 3, "is not a string", id="merge key"),
        pytest.param("a: !!int three\n", 1, "not a valid int", id="not a number"),
        pytest.param("a: &x [*x]\n", 1, "refers to itself", id="alias of itself"),
        pytest.param("a: 1\nb: *nowhere\n", 2, "undefined alias", id="unknown alias"),
        pytest.param("a: \x07\n", 1, "control character", id="control character"),
        pytest.param("a: " + "[" * 200, 1, "51 levels of nesting; the limit is 50", id="depth"),
    ],
)
def test_a_bad_file_is_refused_with_its_line(text: str, line: int | None, words: str) -> None:
    error = refused(text)
    assert error.line == line
    assert words in str(error)
    assert str(error).startswith("config.yaml:")


LONG_NUMBERS = {
    "digits": "1" * 200_000,
    "digits that are no number": "1" * 200_000 + "x",
    "negative": "-" + "9" * 200_000,
    "hexadecimal": "0x" + "f" * 200_000,
    "binary": "0b" + "1" * 200_000,
    "octal": "0" + "7" * 200_000,
    "underscores": "1" + "_" * 200_000,
    "fraction": "1." + "1" * 200_000,
    "exponent": "1e" + "1" * 200_000,
    "base 60": "1" + ":1" * 100_000,
    "base 60 with a fraction": "1" + ":1" * 100_000 + ".5",
    "base 60 with a tag": "!!int 1" + ":1" * 100_000,
    "fraction of base 60 with a tag": "!!float 1" + ":1" * 100_000,
    "digits with a tag": "!!int " + "1" * 200_000,
}


@pytest.mark.parametrize("value", LONG_NUMBERS.values(), ids=LONG_NUMBERS.keys())
def test_a_long_number_is_read_as_a_text_or_refused_at_once(value: str) -> None:
    start = time.process_time()
    try:
        found = load_yaml_text(f"a: {value}")["a"]
    except ConfigFileError as error:
        found = str(error)
    assert time.process_time() - start < 2.0
    assert found == value or (len(found) < 200 and "digits in a number; the limit is 100" in found)


@pytest.mark.parametrize("value", ["!!int ''", "!!int _", "!!float ''", "!!float .", "!!bool maybe", "!!int 0b_"])
def test_a_tag_of_another_value_is_refused(value: str) -> None:
    assert "is not a valid" in str(refused(f"a: {value}"))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12:30", "12:30"),
        ("1:30:00.5", "1:30:00.5"),
        ("0x1F", 31),
        ("0b101", 5),
        ("017", 15),
        ("-1_000", -1000),
        ("1.", 1.0),
        ("+1.5e+3", 1500.0),
        ("1.5E-3", 0.0015),
        ("-.5", -0.5),
        ("-.inf", -math.inf),
        ("08", "08"),
        ("1e", "1e"),
        (".", "."),
        ("1.2.3", "1.2.3"),
        ("1٣", "1٣"),
    ],
)
def test_numbers_are_read_as_in_yaml_1_2_and_octals_as_in_yaml_1_1(text: str, value: object) -> None:
    found = load_yaml_value(text, "a")
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize("tag", ["!!python/object/apply:os.system", "!!python/name:os.system", "!!python/tuple"])
def test_python_tags_are_never_executed(tag: str, tmp_path: Path) -> None:
    witness = tmp_path / "witness"
    error = refused(f"a: 1\nb: {tag} ['touch {witness}']\n")
    assert error.line == 2
    assert "would execute Python code" in str(error)
    assert not witness.exists()


def test_an_alias_bomb_is_refused() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
    assert "100,001 values with aliases expanded; the limit is 100,000" in str(refused("\n".join(lines)))


def test_plain_aliases_work() -> None:
    assert load_yaml_text("a: &net [64, 64]\nb: *net\n") == {"a": [64, 64], "b": [64, 64]}


def test_a_file_that_is_not_utf8_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_bytes(b"a: 1\nb: \xff\xfe\n")
    with pytest.raises(ConfigFileError, match=r"config\.yaml:2: is not UTF-8"):
        load_yaml(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigFileError, match=r"missing\.yaml: cannot be read"):
        load_yaml(tmp_path / "missing.yaml")


def test_a_byte_order_mark_does_not_hurt(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert load_yaml(path) == {"a": 1}


def test_merging_is_deep_and_remembers_whose_value_it_is() -> None:
    below = load_yaml_text("a:\n  x: 1\n  y: 2\n", "below.yaml")
    above = load_yaml_text("\na:\n  y: 3\n", "above.yaml")
    merged = merge(below, above, {"a": {"z": 4}})
    assert merged == {"a": {"x": 1, "y": 3, "z": 4}}
    assert find_origin(merged, ["a", "x"]) == (Path("below.yaml"), 2)
    assert find_origin(merged, ["a", "y"]) == (Path("above.yaml"), 3)
    assert find_origin(merged, ["a", "z"]) is None
    assert below == {"a": {"x": 1, "y": 2}}


def test_a_list_or_scalar_replaces() -> None:
    assert merge({"a": [1, 2]}, {"a": [3]}) == {"a": [3]}
    assert merge({"a": {"b": 1}}, {"a": None}) == {"a": None}


@pytest.mark.parametrize(("text", "value"), [("3", 3), ("[1, 2]", [1, 2]), ("{a: 1e-3}", {"a": 1e-3}), ("", None)])
def test_single_values_are_read(text: str, value: object) -> None:
    assert load_yaml_value(text, "--set x") == value


def test_what_is_written_is_read_back() -> None:
    values = {
        "a": {"b": [1, 2.5, "tëxt", None, True]},
        "c": "1e-4",
        "d": 1e-4,
        "e": "on",
        "a\u202eb": "\u2066\xad\U000e0001",
    }
    assert load_yaml_text(dump_yaml(values)) == values

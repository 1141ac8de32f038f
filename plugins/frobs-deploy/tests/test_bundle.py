from __future__ import annotations

import io
import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import pytest
from bundles import first_two, manifest, space, write

from frobs_deploy import Policy, pack_bundle, read_bundle
from frobs_deploy.errors import BundleError


def archive(members: list[tuple[str, bytes]], compression: int = zipfile.ZIP_STORED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as file:
        for name, data in members:
            file.writestr(name, data)
    return buffer.getvalue()


def members(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as file:
        return {name: file.read(name) for name in file.namelist()}


def test_a_bundle_says_what_was_put_into_it(arm: Path) -> None:
    bundle = read_bundle(arm)
    assert {key: bundle.manifest[key] for key in manifest()} == manifest()
    assert bundle.graph == first_two()
    assert bundle.license == "MIT\n"
    assert bundle.manifest["format"] == 1


def test_the_same_bundle_is_the_same_bytes() -> None:
    assert pack_bundle(manifest(), b"graph", "text") == pack_bundle(manifest(), b"graph", "text")


def test_a_bundle_that_is_cut_anywhere_is_refused(arm: Path, tmp_path: Path) -> None:
    data, cut = arm.read_bytes(), tmp_path / "cut.frobs"
    for length in range(0, len(data)):
        cut.write_bytes(data[:length])
        with pytest.raises(BundleError, match=r"cut\.frobs: the (bundle|file) is (damaged|not a policy bundle)"):
            read_bundle(cut)


def test_a_flipped_bit_is_refused_or_changes_nothing(arm: Path, tmp_path: Path) -> None:
    data, flipped, whole = arm.read_bytes(), tmp_path / "flipped.frobs", read_bundle(arm)
    refused = 0
    for place in range(len(data)):
        flipped.write_bytes(data[:place] + bytes([data[place] ^ (1 << place % 8)]) + data[place + 1 :])
        try:
            found = read_bundle(flipped)
        except BundleError:
            refused += 1
        else:  # a date, or an attribute of the archive
            assert (found.manifest, found.graph, found.license) == (whole.manifest, whole.graph, whole.license)
    assert refused > 0.9 * len(data)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        ([], "contains nothing"),
        ([("../policy.onnx", b"")], "contains '../policy.onnx'"),
        ([("data.pkl", b"")], "contains 'data.pkl'"),
        ([(f"{i}", b"") for i in range(9)], r"'3', … \(9 in all\)"),
    ],
    ids=["empty", "elsewhere", "stranger", "many"],
)
def test_members_with_other_names_are_refused(made: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.frobs"
    path.write_bytes(archive(made))
    with pytest.raises(BundleError, match=message):
        read_bundle(path)


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("extra", ["data.pkl", "policy.onnx"])
def test_a_member_too_many_is_refused(extra: str, arm: Path) -> None:
    arm.write_bytes(archive([*members(arm).items(), (extra, b"x")]))
    with pytest.raises(BundleError, match="the file is not a policy bundle: it contains"):
        read_bundle(arm)


def test_what_could_swell_when_it_is_opened_is_refused(arm: Path) -> None:
    bomb = {**members(arm), "policy.onnx": bytes(50_000_000)}
    arm.write_bytes(archive(list(bomb.items()), zipfile.ZIP_DEFLATED))
    assert arm.stat().st_size < 100_000
    with pytest.raises(BundleError, match=r"because bundle\.json in the archive is compressed"):
        read_bundle(arm)


def test_a_member_of_no_plausible_size_is_refused(arm: Path) -> None:
    arm.write_bytes(archive([*{**members(arm), "LICENSE": b" " * 2_000_000}.items()]))
    with pytest.raises(BundleError, match="LICENSE is 2,000,000 bytes, larger than the limit"):
        read_bundle(arm)


def test_another_network_than_the_manifest_means_is_refused(arm: Path) -> None:
    arm.write_bytes(archive([*{**members(arm), "policy.onnx": b"another"}.items()]))
    with pytest.raises(BundleError, match=r"policy\.onnx does not match its checksum"):
        read_bundle(arm)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"[]", "is not a JSON object"),
        (b"{", "is damaged"),
        (b"\xff", "is damaged"),
        (b"[" * 100_000, "is damaged"),
        (b'{"format": 2}', "has format 2, but this version of FRobs supports only format 1"),
        (b'{"format": 1}', "does not match its checksum"),
        (b'{"format": 1, "files": {"policy.onnx": 3}}', "does not match its checksum"),
    ],
    ids=["list", "cut", "binary", "deep", "newer", "without sums", "wrong sums"],
)
def test_a_manifest_that_cannot_be_read_is_refused(text: bytes, message: str, arm: Path) -> None:
    arm.write_bytes(archive([*{**members(arm), "bundle.json": text}.items()]))
    with pytest.raises(BundleError, match=message):
        read_bundle(arm)


def test_a_pickle_is_no_bundle(tmp_path: Path) -> None:
    witness, path = tmp_path / "witness", tmp_path / "bomb.frobs"

    class Bomb:
        def __reduce__(self) -> Any:
            return (Path.touch, (witness,))

    path.write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(BundleError, match="not a policy bundle"):
        read_bundle(path)
    assert not witness.exists()


@pytest.mark.parametrize(("where", "message"), [("missing.frobs", "No such file"), ("", "is a folder")])
def test_a_path_that_is_no_file_is_named(where: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(BundleError, match=message):
        read_bundle(tmp_path / where)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("control_timestep", -1.0),
        ("control_timestep", "fast"),
        ("robot", {}),
        ("action", {"space": {"type": "Dict"}}),
        (
            "action",
            {"space": {"type": "Box", "shape": [2], "dtype": "object", "low": 0, "high": 1}, "max_change": None},
        ),
        ("action", {"space": {"type": "Box", "shape": [2], "dtype": "float32", "low": [0], "high": [1, 2, 3]}}),
        ("observation", {"spaces": {}, "terms": []}),
        ("observation", {"spaces": {"": manifest()["action"]["space"]}, "terms": [{"name": "x", "columns": [1, 5]}]}),
    ],
)
def test_a_manifest_that_makes_no_sense_is_refused(key: str, value: Any, tmp_path: Path) -> None:
    with pytest.raises(BundleError, match=r"bundle\.json is damaged"):
        Policy(write(tmp_path / "odd.frobs", **{key: value}))


@pytest.mark.parametrize("missing", list(manifest())[1:4])
def test_a_manifest_that_lacks_something_is_refused(missing: str, tmp_path: Path) -> None:
    said = {key: value for key, value in manifest().items() if key != missing}
    path = tmp_path / "short.frobs"
    path.write_bytes(pack_bundle(said, first_two(), ""))
    if missing == "controller":  # nothing of it is needed to run
        assert Policy(path)
        return
    with pytest.raises(BundleError, match=f"'{missing}' is missing"):
        Policy(path)


def test_a_graph_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BundleError, match=r"policy\.onnx"):
        Policy(write(tmp_path / "odd.frobs", b"no graph"))


def test_a_graph_for_another_observation_is_refused(tmp_path: Path) -> None:
    other = {
        "spaces": {"": {**json.loads(json.dumps(manifest()["observation"]["spaces"][""])), "shape": [4]}},
        "terms": [],
    }
    with pytest.raises(BundleError, match=r"does not match the description in bundle\.json"):
        Policy(write(tmp_path / "odd.frobs", observation=other))


@pytest.mark.parametrize("where", ["action", "observation"])
def test_a_space_that_would_fill_the_memory_is_refused(where: str, tmp_path: Path) -> None:
    huge = space(10**12)
    changes: dict[str, Any] = {
        "action": {"space": huge, "max_change": None},
        "observation": {"spaces": {"": huge}, "terms": []},
    }
    path = write(tmp_path / "huge.frobs", **{where: changes[where]})
    with pytest.raises(BundleError, match=r"has more than 16,777,216 numbers"):
        Policy(path)


def test_a_path_that_no_file_can_have_is_refused() -> None:
    with pytest.raises(BundleError, match="cannot be read"):
        read_bundle("a\0b")

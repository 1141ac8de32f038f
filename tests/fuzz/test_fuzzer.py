"""150 fuzzed inputs of a fixed seed, and proof that the fuzzer sees each kind of fault."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import cases
import fuzz
import mutations
import server
import verdicts

BAD = '''
import ctypes, os, pickle, subprocess, sys, time
from frobs_cli.commands import Command
from frobs_core.util.errors import ConfigurationError

COMMANDS = (Command(name="misbehave", summary="Do something wrong.", function="misbehaving:misbehave"),)

def spin():
    while True:
        pass

def step():
    spin()

def grow():
    kept = []
    while True:
        kept.append(bytes([1]) * 2**24)

def allocate_and_end():
    kept = bytes([1]) * 2**28
    raise ConfigurationError("the file is too large.")

def fail():
    raise ConfigurationError("a setting is wrong.")

def traceback():
    {}["key"]

def reported_traceback():
    raise ConfigurationError("bad.\\n  Traceback (most recent call last):")

def native():
    libc = ctypes.CDLL(None)
    libc.creat(b"../outside/made", 0o644)

def unpickle():
    pickle.loads(b"cos\\ngetpid\\n(tR.")

def through_a_link():
    os.symlink("../outside/plots", "plots")
    open("plots/old.png", "w")

def relative_to_a_folder():
    os.mkdir("made", dir_fd=os.open("../outside", os.O_RDONLY))

def run_file():
    import runpy

    runpy.run_path("fuzz_canary.py")

DOES = {
    "nothing": lambda: None,
    "a clear error": fail,
    "a traceback": traceback,
    "a traceback in a message": reported_traceback,
    "a hang": spin,
    "a blocked process": lambda: time.sleep(1000),
    "a hang of a program": lambda: subprocess.run(["sleep", "1000"]),
    "simulation": step,
    "growth": grow,
    "growth before the end": allocate_and_end,
    "an escape sequence": lambda: print("\\x1b[31m"),
    "an escape sequence of one byte": lambda: print("\\x9b31m", file=sys.stderr),
    "no message": lambda: sys.exit(2),
    "a strange exit code": lambda: sys.exit(7),
    "a crash": lambda: ctypes.string_at(0),
    "an internal message": lambda: fail_with("'NoneType' object has no attribute 'x'"),
    "a long message": lambda: fail_with("word " * 2_000),
    "JSON that is not": lambda: print("NaN"),
    "a program": lambda: subprocess.run(["true"]),
    "a shell": lambda: os.system("true"),
    "an unpickled function": unpickle,
    "a file that is executed": run_file,
    "a write outside": lambda: open("../outside/secret.txt", "a"),
    "a write in the home folder": lambda: open(os.path.expanduser("~/x"), "w"),
    "a write through a link": through_a_link,
    "a write relative to a folder": relative_to_a_folder,
    "a write of native code": native,
    "a removal outside": lambda: os.remove("../outside/secret.txt"),
    "a write of a program": lambda: subprocess.run(["touch", "../outside/x"]),
    "a look-up of a host": lambda: __import__("socket").getaddrinfo("frobs.invalid", 80),
}

def fail_with(text):
    raise ConfigurationError(text)

def misbehave(file: str, json: bool = False) -> None:
    """Do something wrong.

    Example:
        $ frobs misbehave file
    """
    try:
        DOES[file]()
    except OSError:
        pass
'''
SEEN = {
    "nothing": set(),
    "a clear error": set(),
    "a traceback": {"traceback"},
    "a traceback in a message": {"traceback"},
    "a hang": {"hang"},
    "a blocked process": {"hang"},
    "a hang of a program": {"hang", "execution"},
    "simulation": {"hang"},
    "growth": {"growth"},
    "growth before the end": {"growth"},
    "an escape sequence": {"control"},
    "an escape sequence of one byte": {"control"},
    "no message": {"error line"},
    "a strange exit code": {"exit code"},
    "a crash": {"exit code"},
    "an internal message": {"unclear"},
    "a long message": {"unclear"},
    "JSON that is not": {"JSON"},
    "a program": {"execution"},
    "a shell": {"execution"},
    "an unpickled function": {"execution"},
    "a file that is executed": {"execution"},
    "a write outside": {"write"},
    "a write in the home folder": {"write"},
    "a write through a link": {"write"},
    "a write relative to a folder": {"write"},
    "a write of native code": {"write"},
    "a removal outside": {"write"},
    "a write of a program": {"write", "execution"},
    "a look-up of a host": {"network"},
}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an installed distribution whose command misbehaves."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "misbehaving.py").write_text(BAD)
    info = folder / "misbehaving-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: misbehaving\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[frobs.commands]\nmisbehaving = misbehaving:COMMANDS\n")
    return folder


@pytest.fixture(scope="module")
def running(site: Path) -> Iterator[server.Server]:
    """A server with the command that misbehaves."""
    with server.Server([site]) as running:
        yield running


def run(running: server.Server, folder: Path, what: str, *options: str) -> tuple[cases.Case, list[str], dict[str, Any]]:
    """Run the command that misbehaves, with low limits."""
    work = server.prepare(folder)
    (work / "fuzz_canary.py").write_text("")
    words = ["misbehave", what, *options]
    result = running.run(folder, words, cpu=1.0, idle=1.0, growth=2**27)
    return cases.Case("robot", "", (), False, tuple(words)), words, result


@pytest.mark.slow
@pytest.mark.parametrize(("what", "symptoms"), SEEN.items(), ids=SEEN)
def test_the_fuzzer_sees(running: server.Server, tmp_path: Path, what: str, symptoms: set[str]) -> None:
    options = ["--json"] if "JSON" in what else []
    case, words, result = run(running, tmp_path / "case", what, *options)
    found = verdicts.judge(case, words, result)
    assert {fault.symptom for fault in found} == symptoms, (found, result)


@pytest.mark.slow
def test_a_hang_is_reported_with_its_place_and_work_that_was_asked_for_is_none(
    running: server.Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, words, result = run(running, tmp_path / "case", "a hang")
    assert result["killed"] == "slow"
    assert "in spin" in result["stack"]
    case, words, result = run(running, tmp_path / "case", "simulation")
    monkeypatch.setattr(verdicts, "WORKERS", {"misbehave"})
    assert verdicts.judge(case, words, result) == []


@pytest.mark.slow
def test_events_of_valid_inputs_are_no_faults(running: server.Server, tmp_path: Path) -> None:
    case, words, result = run(running, tmp_path / "case", "a program")
    assert verdicts.judge(case, words, result, frozenset(verdicts.events(result))) == []


@pytest.mark.slow
def test_a_new_command_is_fuzzed_without_a_change_of_the_fuzzer(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from frobs_cli.program import walk

    monkeypatch.syspath_prepend(str(site))
    importlib.invalidate_caches()
    commands = cases.Commands(walk())
    assert {"frobs misbehave", "frobs train", "frobs doctor robot", "frobs migrate"} <= set(commands.names)
    for kind in ("robot", "mesh"):
        assert ("misbehave", cases.INPUT) in commands.templates(kind)
    reached = {
        name
        for kind in fuzz.KINDS
        for words in commands.templates(kind)
        for name in (" ".join(words[:1]), " ".join(words[:2]))
    }
    takes_none = {"frobs list", "frobs plugins", "frobs legacy env"}
    assert {name.removeprefix("frobs ") for name in set(commands.names) - takes_none} <= reached


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("r.urdf", b'<robot name="r"><link name="a"><origin xyz="0 0 1"/></link><link name="b"/></robot>'),
        ("c.yaml", b"a: 1\nb: [1.5, x]\nc: {d: null, e: text}\n"),
        ("c.json", b'{"a": 1, "b": [1.5, "x"], "c": {"d": null, "e": "text"}}'),
        ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("m.stl", bytes(range(200))),
    ],
)
def test_mutations_change_files_and_repeat(tmp_path: Path, name: str, data: bytes) -> None:
    kind = mutations.format_of(name)
    fitting = [key for key in mutations.OPERATIONS if key.startswith(f"{kind}_")]
    assert len(fitting) >= 3
    changed = 0
    for operation in fitting:
        results = []
        for _ in range(2):
            (tmp_path / name).write_bytes(data)
            mutations.apply(mutations.Mutation(operation, 0, 7, 3), [tmp_path / name])
            results.append((tmp_path / name).read_bytes())
        assert results[0] == results[1]
        changed += results[0] != data
    assert changed >= len(fitting) // 2


def test_a_file_that_would_exhaust_memory_is_left_as_it_is(tmp_path: Path) -> None:
    text = "a0: &a0 {x: 1}\n" + "".join(f"a{i}: &a{i} {{<<: [{f'*a{i - 1}, ' * 90}]}}\n" for i in range(1, 12))
    (tmp_path / "c.yaml").write_text(text)
    mutations.apply(mutations.Mutation("data_replace", 0, 7, 3), [tmp_path / "c.yaml"])
    assert (tmp_path / "c.yaml").read_text() == text


def test_a_case_can_be_stored_and_repeated() -> None:
    case = cases.Case("run", "x", (mutations.Mutation("path_fifo", 1, 2, 3),), True, ("show", cases.INPUT))
    assert cases.Case.from_data(json.loads(json.dumps(case.as_data()))) == case
    assert case.command == "show"


@pytest.mark.slow
def test_150_fuzzed_inputs_show_no_fault(tmp_path: Path) -> None:
    with server.Server() as running:
        fuzzer = fuzz.started(running, tmp_path, tmp_path / "faults")
        fuzz.fuzz(fuzzer, 150)
    assert 140 <= fuzzer.count.total() <= 160
    assert not fuzzer.groups, fuzzer.report()

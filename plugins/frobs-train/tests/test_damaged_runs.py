"""A damaged run folder is reported in one line by every command, and a damaged evaluation is skipped."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from frobs_cli.group import _reported
from frobs_cli.program import program
from frobs_core.util.errors import CheckpointError, FrobsError, RunError
from frobs_core.util.files import read_json
from frobs_train import Run, resume
from frobs_train.comparison.compare import compare
from frobs_train.configuration.config import RunConfig
from frobs_train.export.export_facts import learning_curve
from frobs_train.runs import checksums
from frobs_train.runs.state import RunState, read_best, read_state, write_best

EVALUATION = {
    "success_rate": 0.5,
    "success_interval": [0.4, 0.6],
    "mean_reward": 1.0,
    "mean_length": 10.0,
    "episodes": 100,
    "success_by_octant": {"+x": {"success_rate": 0.5, "episodes": 10}},
    "environment": "CartPole-v1",
    "simulator": None,
    "randomize": None,
    "seed": 1,
    "deterministic": True,
    "steps": 200,
}
LOG = "train/steps,time/elapsed,episode/reward,episode/success,episode/count\n" + "".join(
    f"{100 * i},{i}.5,{i},0.5,3\n" for i in range(1, 9)
)


@pytest.fixture(scope="session")
def intact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a run folder with every kind of file, whose checkpoint has no policy."""
    path = tmp_path_factory.mktemp("runs") / "run"
    config = RunConfig(environment="CartPole-v1", seed=1, steps=1000)
    run = Run.create(path, config)
    run.config = config.model_copy(update={"log_every": 10})
    run.record(config, 100)
    (path / "progress.csv").write_text(LOG)
    (path / "evaluations").mkdir()
    for name in ("a", "b"):
        (path / "evaluations" / f"{name}.json").write_text(json.dumps(EVALUATION))
    for name in ("step_000000200", "best"):
        folder = path / "checkpoints" / name
        folder.mkdir(parents=True)
        RunState(steps=200, elapsed=1.0).write(folder, {})
        write_best(folder, 200, (0.5, 1.0))
        checksums.write_checksums(folder, sorted(folder.iterdir()))
    (path / ".lock").write_text(json.dumps({"pid": 1, "host": "x"}))
    return path


FILES = [
    "config.yaml",
    "history.json",
    "versions.json",
    "progress.csv",
    "evaluations/a.json",
    "checkpoints/step_000000200/checksums.json",
    "checkpoints/step_000000200/run.json",
    "checkpoints/best/best.json",
    "checkpoints/best/checksums.json",
    ".lock",
]


def fifo(path: Path) -> None:
    path.unlink(missing_ok=True)
    os.mkfifo(path)


def device(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to("/dev/zero")


def folder(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.mkdir()


def hole(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**40)


def text(content: str | bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(content if isinstance(content, bytes) else content.encode())


def nested_values(change: object) -> Callable[[Path], None]:
    """Replace every value of the top level, and then every value below, by another."""

    def damage(path: Path) -> None:
        try:
            found = json.loads(path.read_text())
        except ValueError:
            found = {"a": 1}
        path.write_text(json.dumps(dict.fromkeys(found, change)))

    return damage


DAMAGES: dict[str, Callable[[Path], object]] = {
    "missing": lambda path: path.unlink(missing_ok=True),
    "empty": text(""),
    "a list": text("[]"),
    "a list of a list": text("[[]]"),
    "an object": text("{}"),
    "a number": text("1"),
    "a text": text('"x"'),
    "null": text("null"),
    "binary": text(bytes(range(256)) * 4),
    "utf-16": text("{}".encode("utf-16")),
    "deep lists": text("[" * 100_000),
    "lists as deep as Python reads": text("[" * 900 + "]" * 900),
    "deep objects": text('{"a":' * 900 + "1" + "}" * 900),
    "digits": text('{"steps": ' + "1" * 10**6 + "}"),
    "large numbers": text('{"steps": 1e999, "episodes": -1e999, "rank": [1e999, 1], "pid": 1e999}'),
    "long integers": text('{"steps": 1' + "0" * 400 + ', "pid": 1' + "0" * 400 + "}"),
    "unfinished": lambda path: path.write_bytes(path.read_bytes()[:-5] if path.exists() else b"{"),
    "half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2] if path.exists() else b"{"),
    "values null": nested_values(None),
    "values text": nested_values("x"),
    "values lists": nested_values([[]]),
    "values objects": nested_values({"a": {"b": None}}),
    "values negative": nested_values(-1),
    "values not a number": nested_values(float("nan")),
    "values true": nested_values(True),
    "nul": text("\0" * 1000),
    "no line break": text("train/steps,time/elapsed"),
    "header only": text("train/steps,time/elapsed\n"),
    "no steps": text("a,b\n1,2\n"),
    "no time": text("train/steps,episode/reward\n1,2\n"),
    "texts in rows": text("train/steps,time/elapsed\nx,y\n"),
    "infinite": text("train/steps,time/elapsed,episode/reward\ninf,nan,inf\n-inf,1,1\n"),
    "long rows": text("train/steps,time/elapsed\n1,2,3,4\n"),
    "short rows": text("train/steps,time/elapsed\n1\n"),
    "twice": text("train/steps,train/steps,time/elapsed\n1,2,3\n"),
    "long cell": text("train/steps,time/elapsed\n" + "1" * 10**6 + ",1\n"),
    "quotes": text('train/steps,"time/elapsed\n1,2\n'),
    "fifo": fifo,
    "device": device,
    "folder": folder,
    "a terabyte": hole,
}


def uses(run: Path) -> list[Callable[[], object]]:
    """Return what commands do with a run folder, without the environment and the algorithm."""

    def command(*args: str) -> Callable[[], object]:
        def call() -> object:
            found = CliRunner().invoke(program(), [*args, str(run)])
            if found.exception is not None and not isinstance(found.exception, SystemExit):
                raise found.exception
            assert "Traceback" not in found.output
            return found

        return call

    opened = Run.open(run)
    checkpoint = run / "checkpoints" / "step_000000200"
    return [
        command("show"),
        command("show", "--json"),
        lambda: compare([Run.open(run)], metric="reward"),
        lambda: compare([Run.open(run)]),
        lambda: learning_curve(opened, 200),
        lambda: opened.find_checkpoint("newest"),
        lambda: opened.find_checkpoint("best"),
        lambda: read_state(checkpoint),
        lambda: read_best(run / "checkpoints" / "best"),
    ]


def reported(call: Callable[[], object]) -> list[str]:
    """Return the message of the error that a function raises, if any."""
    try:
        call()
    except _reported() as error:
        return [str(error)]
    return []


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_file_never_ends_in_a_traceback(
    intact: Path, tmp_path: Path, name: str, damage: Callable[[Path], object]
) -> None:
    run = tmp_path / "run"
    shutil.copytree(intact, run)
    damage(run / name)
    said = reported(lambda: Run.open(run))
    if not said:
        said = [message for use in uses(run) for message in reported(use)]
    assert all(len(message) < 1000 for message in said)


EVALUATION_DAMAGES = [name for name in DAMAGES if name not in ("missing", "unfinished", "half")]


@pytest.mark.parametrize("damage", EVALUATION_DAMAGES)
def test_a_damaged_evaluation_is_reported_once_and_the_others_are_used(
    intact: Path, tmp_path: Path, damage: str, caplog: pytest.LogCaptureFixture
) -> None:
    run = tmp_path / "run"
    shutil.copytree(intact, run)
    DAMAGES[damage](run / "evaluations" / "a.json")
    opened = Run.open(run)
    found = compare([opened], metric="reward")
    assert found.groups[0].final.value == EVALUATION["mean_reward"]
    assert opened.evaluations() == [EVALUATION]
    assert [record.message.count("a.json") for record in caplog.records] == [1]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("steps", -1),
        ("steps", "200"),
        ("steps", 1e400),
        ("episodes", 0),
        ("episodes", True),
        ("mean_reward", float("nan")),
        ("mean_reward", None),
        ("success_rate", 1.5),
        ("success_interval", [0.1]),
        ("steps_to_success", -1.0),
        ("steps_to_success", "10"),
        ("success_by_octant", {"+x": 1}),
        ("success_by_octant", []),
        ("randomize", [1]),
        ("simulator", 5),
        ("seed", {}),
    ],
)
def test_an_evaluation_with_an_impossible_value_is_ignored(
    intact: Path, tmp_path: Path, key: str, value: object, caplog: pytest.LogCaptureFixture
) -> None:
    run = tmp_path / "run"
    shutil.copytree(intact, run)
    (run / "evaluations" / "a.json").write_text(json.dumps({**EVALUATION, key: value}))
    assert Run.open(run).evaluations() == [EVALUATION]
    assert "a.json is damaged: " in caplog.text


def test_nothing_is_written_through_a_link_out_of_the_run(intact: Path, tmp_path: Path) -> None:
    run, other = tmp_path / "run", tmp_path / "other"
    shutil.copytree(intact, run)
    other.mkdir()
    (run / "plots").symlink_to(other)
    with pytest.raises(RunError, match="outside of the run folder"):
        Run.open(run).output("plots", "learning_curve.png")
    assert not list(other.iterdir())
    (run / "inner").mkdir()
    (run / "plots").unlink()
    (run / "plots").symlink_to("inner")
    assert Run.open(run).output("plots", "a.png") == run / "plots" / "a.png"
    (tmp_path / "link").symlink_to("run")
    assert Run.open(tmp_path / "link").output("plots", "a.png")


@pytest.mark.parametrize("name", ["checkpoints", "tensorboard", "evaluations", "progress.csv", "video.mp4"])
def test_a_training_does_not_go_on_through_a_link_out_of_the_run(intact: Path, tmp_path: Path, name: str) -> None:
    run, other = tmp_path / "run", tmp_path / "other"
    shutil.copytree(intact, run)
    if (run / name).exists():
        (run / name).rename(other)
    (run / name).symlink_to(other)
    before = sorted(other.rglob("*"))
    with pytest.raises(RunError, match=f"{name} is a link to .* outside of the run folder"):
        Run.open(run).output(name) if name == "video.mp4" else resume(run)
    assert sorted(other.rglob("*")) == before


def test_the_lock_does_not_follow_a_link(intact: Path, tmp_path: Path) -> None:
    from frobs_train.runs.lock import RunLock

    run, victim = tmp_path / "run", tmp_path / "victim"
    shutil.copytree(intact, run)
    victim.write_text("keep")
    (run / ".lock").unlink()
    (run / ".lock").symlink_to(victim)
    with pytest.raises(RunError), RunLock(run):
        pass
    assert victim.read_text() == "keep"


@pytest.mark.parametrize("listed", ["../../secret", "/etc/passwd", "pipe", "gone"])
def test_checksums_are_computed_of_the_files_of_the_checkpoint_only(intact: Path, tmp_path: Path, listed: str) -> None:
    run = tmp_path / "run"
    shutil.copytree(intact, run)
    checkpoint = run / "checkpoints" / "step_000000200"
    os.mkfifo(checkpoint / "pipe")
    path = checkpoint / "checksums.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), listed: "0"}))
    with pytest.raises(CheckpointError, match="is missing, or not a regular file"):
        checksums.verify(checkpoint)


@pytest.mark.parametrize("damage", ["a list", "deep lists", "digits", "binary", "fifo", "a terabyte", "empty"])
def test_the_reader_of_json_says_why_in_one_line(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "a.json"
    DAMAGES[damage](path)
    with pytest.raises(OSError, match=r"it |limit|digits") as caught:
        read_json(path)
    assert len(str(caught.value)) < 300


def test_an_intact_run_is_usable(intact: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(intact, run)
    for use in uses(run):
        assert use()
    assert Run.open(run).changes[0]["settings"] == {"log_every": {"from": None, "to": 10}}
    with pytest.raises(FrobsError, match="is not a folder"):
        Run.open(tmp_path / "nothing")

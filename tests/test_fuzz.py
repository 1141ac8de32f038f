"""Generated calls of commands and constructors with invalid values: each ends with one clear error, and soon.

The calls are drawn from fixed seeds, so that a failure repeats.
"""

from __future__ import annotations

import math
import random
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

from frobs_cli.program import program, walk
from frobs_core.kernel.config import KEYWORDS
from frobs_core.plugins.registry import pretrained_path
from frobs_core.util.errors import FrobsError
from frobs_deploy import DeployError, Policy
from frobs_train import RunConfig, resolve_config
from frobs_train.training.threads import decide_threads

pytestmark = pytest.mark.slow

LIMIT = 120  # [s] for one call
CALLS = 12  # for each command
ID = "frobs/Irb120Reach-v0"

NUMBERS = ("x", "nan", "1e400", "1,5", "--", "", "-inf", "0x1g", "²", "[1]")
NAMES = ("no_such", "", "a:b:c", "'", "frobs/Nope-v0", "é" * 300, "-", "5", "[1, 2]", "{}", "*")
SETTINGS = (
    "", "=", "a", "a=", ".=1", "a.b.c=1", "seed=x", "seed=-1", "num_envs=1.5", "num_envs=[1]", "steps=.inf", "steps=0",
    "wrappers=5", "wrappers=[{name: 5}]", "callbacks=[{name: 'a:b'}]", "threads.simulator=.nan", "threads=x",
    "algorithm_config=5", "algorithm_config.gamma=[1]", "algorithm_config.policy_kwargs.net_arch=x", "randomize=5",
    "environment_kwargs=5", "environment_kwargs.num_threads=.inf", "environment_kwargs.robot=5", "algorithm=[1]",
    "environment_kwargs.simulator=null", "environment_kwargs.home={1: 2}", "environment_kwargs.tolerance=[1]", "a={",
    "seed=!!python/object:os.system x", "randomize.mass.scale=a", "stop_at_success=2",
)  # fmt: skip
JUNK: tuple[Any, ...] = (
    None, True, -1, 0, 5, 1.5, math.nan, math.inf, 10**30, "", "x", "a\0b", b"x", [], [1], [1, "a"], [[1], [1, 2]], {},
    {"a": 1}, {1: 2}, {"a": [1]}, (), (1, 2, 3), object, np.zeros(3), np.array(["a"]), 1j, {1, 2}, len,
)  # fmt: skip
NUMERIC = {
    "episodes", "seed", "seeds", "num_envs", "steps", "trials", "threshold", "timeout", "timestep", "goal", "speed",
    "max_update_rate", "clock_frequency", "state_frequency", "seconds",
}  # fmt: skip
CHOICES = {
    "algorithm",
    "robot",
    "simulator",
    "controller",
    "metric",
    "sampler",
    "pruner",
    "format",
    "on_existing",
    "kind",
}
SKIPPED = (
    "frobs",
    "frobs doctor",
    "frobs ros",
    "frobs legacy",
    "frobs legacy run",
    "frobs legacy env",
    "frobs doctor ros",
)
"""Groups, commands without options, and one that starts any program that it is given."""

COMMANDS = {name: command for name, command in walk() if name not in SKIPPED}


class Hang(BaseException):
    """A call took too long."""


@contextmanager
def limited() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(LIMIT)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with damaged files, as the working directory."""
    rng = random.Random(0)
    garbage = rng.randbytes(3_000)
    for name in ("garbage", "garbage.zip", "garbage.urdf", "garbage.xml", "garbage.urdf.xacro", "garbage.yaml"):
        (tmp_path / name).write_bytes(garbage)
    for number, text in enumerate(("[1, 2]", "a: {", "5", "steps: [1]\n", "algorithm_config: 5\n", "? [1]\n: 2\n", "")):
        (tmp_path / f"junk{number}.yaml").write_text(text)
    (tmp_path / "empty").mkdir()
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "config.yaml").write_text("environment: CartPole-v1\nsteps: x\n")
    (tmp_path / "binary").mkdir()
    for name in ("config.yaml", "history.json", "versions.json", "progress.csv"):
        (tmp_path / "binary" / name).write_bytes(garbage)
    (tmp_path / "log").mkdir()
    (tmp_path / "log" / "config.yaml").write_text("environment: CartPole-v1\nseed: 0\n")
    (tmp_path / "log" / "progress.csv").write_bytes(garbage)
    monkeypatch.chdir(tmp_path)
    return tmp_path


FILES = (
    "garbage",
    "garbage.zip",
    "garbage.urdf",
    "garbage.xml",
    "empty",
    "run",
    "binary",
    "log",
    "missing",
    "/dev/null",
)


def invalid(name: str, rng: random.Random) -> str:
    """Return a value that no option of this name accepts."""
    if name in NUMERIC:
        return rng.choice(NUMBERS)
    if name == "settings":
        return rng.choice(SETTINGS)
    if name in CHOICES:
        return rng.choice(NAMES)
    if name in ("config", "file", "space"):
        return rng.choice([f"junk{rng.randrange(6)}.yaml", "garbage.yaml", "missing", "empty"])
    return rng.choice((*FILES, *NAMES))


def arguments(command: Any, rng: random.Random) -> list[str]:
    """Return a command line whose positional arguments, or one of whose options, cannot be used."""
    words: list[str] = []
    positional = [item for item in command.params if not item.opts[0].startswith("-")]
    options = [
        item
        for item in command.params
        if item not in positional and item.name in NUMERIC | CHOICES | {"settings", "config", "file", "space"}
    ]
    chosen = rng.sample(options, min(len(options), rng.randrange(3)))
    for item in chosen:
        words += [item.opts[0], *(invalid(item.name, rng) for _ in range(max(1, item.nargs)))]
    for item in positional:
        good = ["CartPole-v1", ID] if item.name == "env_id" and chosen else []
        words += [rng.choice(good or FILES + NAMES) for _ in range(1 if item.nargs > 0 else rng.randrange(1, 3))]
    return words


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_reports_invalid_arguments_in_one_line(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:9")  # another test may have started a master
    app, runner = program(), CliRunner()
    rng = random.Random(name)
    for _ in range(CALLS):
        words = [*name.split()[1:], *arguments(COMMANDS[name], rng)]
        with limited():
            result = runner.invoke(app, words, prog_name="frobs", catch_exceptions=False)
        errors = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
        assert result.exit_code in (0, 1, 2), (words, result.output)
        assert "Traceback" not in result.output, words
        assert len(errors) == (result.exit_code == 2), (words, result.output)


def reject(call: Callable[[], Any], *described: Any) -> None:
    """Make a call that may raise the errors of FRobs and Gymnasium, and no others."""
    try:
        with limited():
            made = call()
    except (FrobsError, DeployError, gym.error.Error):
        return
    except Exception as error:
        raise AssertionError(described) from error
    if hasattr(made, "close"):
        made.close()


@pytest.mark.parametrize("keyword", [*sorted(KEYWORDS - {"render_mode"}), "tolerance", "goal_low", "goal_high"])
def test_an_environment_rejects_invalid_keywords(keyword: str) -> None:
    rng = random.Random(keyword)
    for value in rng.sample(JUNK, 12):
        reject(partial(gym.make, ID, disable_env_checker=True, **{keyword: value}), keyword, value)


@pytest.mark.parametrize("value", JUNK, ids=repr)
def test_an_environment_rejects_invalid_calls(value: Any) -> None:
    for make in (gym.make, lambda id: gym.make_vec(id, 2, vectorization_mode="vector_entry_point")):
        env: Any = make(ID).unwrapped
        for options in (value, {"goal": value}, {"joint_positions": value}, {"reset_mask": value}, {value.__hash__: 1}):
            reject(partial(env.reset, options=options), "options", options)
        reject(partial(env.reset, seed=value), "seed", value)
        env.reset(seed=0)
        reject(partial(env.step, value), "action", value)
        env.close()
    reject(lambda: gym.make_vec(ID, num_envs=value, vectorization_mode="vector_entry_point"), "num_envs", value)


@pytest.mark.parametrize("keyword", ["robot", "joint_names", "control_timestep", "max_change", "num_threads"])
def test_a_policy_rejects_invalid_arguments(keyword: str) -> None:
    path = pretrained_path(ID)
    for value in JUNK:
        reject(partial(Policy, path, **{keyword: value}), keyword, value)


def test_a_policy_rejects_invalid_calls() -> None:
    policy = Policy(pretrained_path(ID))
    for value in JUNK:
        reject(partial(policy.act, value), "observation", value)
        reject(partial(policy.reset, value), "mask", value)
        reject(partial(policy.reset, previous_action=value), "previous_action", value)


@pytest.mark.parametrize("environment", ["CartPole-v1", ID])
def test_a_configuration_rejects_invalid_settings(environment: str) -> None:
    def resolve(*settings: str) -> RunConfig:
        config = resolve_config(environment, settings=settings)
        decide_threads(config)
        return config

    for setting in SETTINGS:
        reject(partial(resolve, setting), setting)

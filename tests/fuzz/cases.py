"""Cases: an input, its mutations and a command. Hypothesis draws them; each can be stored and repeated."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import values
from hypothesis import strategies as st
from mutations import OPERATIONS, PATH_OPERATIONS, Mutation, apply, format_of, sign
from seeds import Seed
from server import prepare

from frobs_cli.commands import installed_commands

INPUT = "@INPUT@"
"""Stands for the path of the input in a command line."""

ARGUMENTS: Mapping[str, frozenset[str]] = {
    "robot": frozenset({"file", "name"}),
    "mesh": frozenset({"file", "name"}),
    "yaml": frozenset({"path"}),
    "bundle": frozenset({"runs", "run", "bundle", "name"}),
    "run": frozenset({"runs", "run", "name"}),
    "model": frozenset(),
    "package": frozenset({"path"}),
}
"""Arguments of commands that take an input, by kind. Arguments that are neither here nor in :data:`OTHER` take all kinds."""

OPTIONS: Mapping[str, frozenset[str]] = {
    "robot": frozenset({"robot", "robot_file"}),
    "mesh": frozenset({"robot", "robot_file"}),
    "yaml": frozenset({"config", "file", "space"}),
    "bundle": frozenset(),
    "run": frozenset(),
    "model": frozenset({"model"}),
    "package": frozenset(),
}
"""Options of commands that take an input, by kind."""

OTHER: Mapping[str, str] = {
    "env_id": "CartPole-v1",
    "env_ids": "CartPole-v1",
    "what": "robot",
    "kind": "envs",
    "subject": "CartPole-v1",
    "names": "",
    "command": "",
}
"""Values of arguments that take no file."""

SKIPPED: Mapping[str, str] = {
    "frobs": "the group",
    "frobs legacy run": "runs the program that it is given",
    "frobs doctor plugins": "imports each installed plugin in a process of its own",
    "frobs bench": "measures for seconds what it is given",
    "frobs parity": "simulates for a minute",
    "frobs doctor ros": "takes no input",
}
"""Commands that are not run, and the reason."""

BOUNDS = {"steps": "96", "num_envs": "1", "episodes": "1", "trials": "1", "seeds": "1", "seconds": "1", "timeout": "1"}
"""Values of options that bound the work of a command."""

UNBOUND = {"frobs check steps", "frobs train seeds"}
"""Options that change what the command does."""

RARE = {"frobs export", "frobs play", "frobs tune", "frobs check", "frobs new"}
"""Commands that take seconds and are drawn less often."""

CLOSED = {
    "install_completion",
    "show_completion",
    "runner",
    "ray_address",
    "log",
    "jobs",
    "processes",
    "listen",
    "storage",
}
"""Options that are not drawn: they change the shell's settings or start servers of other programs."""


@dataclass(frozen=True)
class Case:
    """One run of a command.

    Attributes:
        kind: Kind of the input, or ``command``.
        seed: Name of the input; empty for a command line.
        mutations: Changes to the input.
        signed: Whether checksums are corrected afterwards.
        words: Command line, with :data:`INPUT` for the path of the input.
    """

    kind: str
    seed: str
    mutations: tuple[Mutation, ...]
    signed: bool
    words: tuple[str, ...]

    def as_data(self) -> dict[str, Any]:
        """Return the case as plain data."""
        return asdict(self)

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Case:
        """Return the case of :meth:`as_data`."""
        mutations = tuple(Mutation(**item) for item in data["mutations"])
        return cls(data["kind"], data["seed"], mutations, data["signed"], tuple(data["words"]))

    @property
    def command(self) -> str:
        """Name of the command."""
        names, _ = installed_commands()
        both = " ".join(self.words[:2])
        return both if both in names else self.words[0] if self.words else ""


def build(case: Case, corpus: Mapping[str, Sequence[Seed]], folder: Path) -> list[str]:
    """Write the input of a case into ``folder/work`` and return its command line."""
    work = prepare(folder)
    canary = f"open({values.CANARY!r}, 'w')\n\nclass Wrapper: ...\n"
    (work / "fuzz_canary.py").write_text(canary)
    if case.kind == "command":
        for seeds, name in (
            ("run", "my_run"),
            ("bundle", "policy.frobs"),
            ("robot", "my_arm.urdf"),
            ("yaml", "config.yaml"),
        ):
            _copy(corpus[seeds][0], work)
            assert (work / name).exists()
        return list(case.words)
    seed = next(seed for seed in corpus[case.kind] if seed.name == case.seed)
    _copy(seed, work)
    (work / "fuzz_canary.py").unlink()
    files = sorted(path for path in work.rglob("*") if path.is_file())
    (work / "fuzz_canary.py").write_text(canary)
    for mutation in case.mutations:
        apply(mutation, files)
    if case.signed:
        sign(work)
    return [seed.main if word == INPUT else word for word in case.words]


def _copy(seed: Seed, work: Path) -> None:
    shutil.copytree(seed.folder, work, dirs_exist_ok=True, symlinks=True)


class Commands:
    """The command lines of all installed commands, from their parameters.

    Args:
        walked: Name and command of each command, from ``frobs_cli.program.walk``.

    Attributes:
        refused: Kinds and command lines that refuse valid inputs, so that they are drawn less often.
    """

    def __init__(self, walked: Iterator[tuple[str, Any]]) -> None:
        self._commands = {
            name: command for name, command in walked if name not in SKIPPED and not hasattr(command, "commands")
        }
        self.refused: set[tuple[str, tuple[str, ...]]] = set()

    @property
    def names(self) -> list[str]:
        """Names of the commands."""
        return list(self._commands)

    def templates(self, kind: str) -> list[tuple[str, ...]]:
        """Return command lines that open an input of a kind; those that are drawn often occur several times."""
        found = []
        known = frozenset().union(*ARGUMENTS.values(), OTHER)
        for name, command in self._commands.items():
            for parameter in command.params:
                is_argument = parameter.param_type_name == "argument"
                takes = (
                    not getattr(parameter, "is_flag", False)
                    and parameter.name in (ARGUMENTS if is_argument else OPTIONS)[kind]
                )
                if takes or (is_argument and parameter.name not in known):
                    words = self._template(name, command, parameter, kind)
                    found += [words] * (1 if name in RARE or (kind, words) in self.refused else 8)
        return found

    def _template(self, name: str, command: Any, target: Any, kind: str) -> tuple[str, ...]:
        words = name.split()[1:]
        for parameter in command.params:
            if parameter is target:
                words += [INPUT] if parameter.param_type_name == "argument" else [parameter.opts[0], INPUT]
            elif parameter.param_type_name == "argument" and parameter.required:
                robot = kind in ("robot", "mesh")
                words += ["frobs/Reach-v0" if robot else OTHER.get(parameter.name, "CartPole-v1")]
            elif parameter.param_type_name == "argument" and name == "frobs new":
                words += [{"what": "robot", "name": "my_robot"}[parameter.name]]
            elif parameter.name in BOUNDS and f"{name} {parameter.name}" not in UNBOUND:
                words += [parameter.opts[0], BOUNDS[parameter.name]]
        if name == "frobs play":
            words += ["--video", "v.mp4"]
        return tuple(words)

    def options(self, words: Sequence[str]) -> list[Any]:
        """Return the options of the command of a command line."""
        for size in (2, 1):
            command = self._commands.get(" ".join(["frobs", *words[:size]]))
            if command is not None:
                return [p for p in command.params if p.param_type_name == "option" and p.name not in CLOSED]
        return []


@st.composite
def file_cases(draw: st.DrawFn, kind: str, corpus: Mapping[str, Sequence[Seed]], commands: Commands) -> Case:
    """Draw a case with an input of a kind."""
    ordinary = [seed for seed in corpus[kind] if not seed.attack]
    attacks = [seed for seed in corpus[kind] if seed.attack]
    seed = draw(st.sampled_from(attacks if attacks and draw(st.integers(0, 3)) == 3 else ordinary))
    formats = sorted({format_of(path.name) for path in seed.folder.rglob("*") if path.is_file()})
    index = st.sampled_from(range(1009))
    fitting = sorted(key for key in OPERATIONS if key.partition("_")[0] in formats)
    fitting += ["archive_inner"] * 20 if kind == "bundle" else []
    inside = st.builds(Mutation, st.sampled_from(fitting), index, index, index)
    whole = st.builds(Mutation, st.sampled_from(sorted(PATH_OPERATIONS)), index, index, index)
    often = [inside] * (2 if kind in ("run", "package") else 8)
    mutations = draw(st.lists(st.one_of(*often, whole), min_size=0 if seed.attack else 1, max_size=4))
    words = draw(st.sampled_from(commands.templates(kind)))
    return Case(
        kind, seed.name, tuple(mutations), draw(st.booleans()), (*words, *draw(_extra(commands.options(words))))
    )


def _extra(options: Sequence[Any]) -> st.SearchStrategy[tuple[str, ...]]:
    """Return a strategy of harmless options: ``--json``, arguments of the model, a simulator."""
    there = {option.name for option in options}
    choices: list[tuple[str, ...]] = [()] * 4
    choices += [("--json",)] * 2 if "json" in there else []
    choices += [("--simulator", "pybullet")] if "simulator" in there else []
    choices += [("--args", "a:=${b}"), ("--args", "prefix:=\x1b[31m")] if "args" in there else []
    choices += [("--config",)] if any(option.name == "config" and option.is_flag for option in options) else []
    return st.sampled_from(choices)


SETTINGS = (
    "=", "a", "a=", ".=1", "a.b.c=1", "seed=x", "steps=1e5", "steps=.inf", "steps=-1", "num_envs=1.5", "wrappers=5", "callbacks=[{}]",
    "wrappers=[{name: 5}]", "algorithm_config=5", "algorithm_config.gamma=nan", "algorithm_config.n_steps=0", "log_every=0",
    "algorithm_config.policy_kwargs.net_arch=x", "algorithm_config.policy_kwargs.net_arch=[100000000]", "checkpoint_every=-1",
    "environment_kwargs.x=1", "environment_kwargs={1: 2}", "environment=[1]", "randomize.mass.scale=a", "a={", "é=1", "\x1b=1", "=\x1b",
    "seed=!!python/object/apply:os.system [touch FUZZ_EXECUTED]", "a=" + "[" * 5000, "seed=" + "1" * 200_000, "seed=1:1:1", "a.=1",
    "__class__=1", "steps=１", "evaluate_every=1e400", "keep_checkpoints=null", "threads.torch=1e9", "stop_at_success=nan", "? a=1",
    "algorithm_config.learning_rate=0", "algorithm_config.batch_size=1e9", "environment_kwargs.render_mode=human", "&a x=*a",
)  # fmt: skip
FILES = (
    "my_run",
    "policy.frobs",
    "my_arm.urdf",
    "config.yaml",
    "CartPole-v1",
    "frobs/Reach-v0",
    "frobs/Irb120Reach-v0",
    "irb120",
    ".",
)
PATHS = (
    "",
    ".",
    "made",
    "my_run",
    "made/a/b",
    "x" * 300,
    "é",
    "\x1b[31m",
    "a\nb",
    "/dev/null/x",
    "/dev/full",
    "config.yaml/x",
    "-",
    "nul",
)
NUMBERS = (*values.NUMBERS[:32], "1", "2", "-1", "1e5", "9" * 30, "-0.0", "1_000", "0x1", "1e400", "inf")


@st.composite
def command_lines(draw: st.DrawFn, commands: Commands) -> Case:
    """Draw a command line with hostile words."""
    name = draw(st.sampled_from([name for name in commands.names for _ in range(1 if name in RARE else 3)]))
    words, chosen = name.split()[1:], commands.options(name.split()[1:])
    arguments = draw(st.lists(st.sampled_from((*FILES, *FILES, *values.NAMES)), max_size=3))
    for option in draw(st.lists(st.sampled_from(chosen), max_size=4)) if chosen else []:
        words += [draw(st.sampled_from(option.opts))]
        if not option.is_flag:
            words += [draw(option_values(option.name)) for _ in range(max(1, option.nargs))]
    words += arguments
    words += draw(
        st.sampled_from(
            ((), (), (), ("--no-such",), ("--",), ("--", "-x"), ("--json",), ("--seed",), ("-é",), ("--set=x",))
        )
    )
    bounds = [
        [option.opts[0], BOUNDS[option.name]]
        for option in chosen
        if option.name in BOUNDS and option.opts[0] not in words and f"{name} {option.name}" not in UNBOUND
    ]
    if draw(st.integers(0, 3)):
        words[len(name.split()) - 1 : len(name.split()) - 1] = [word for pair in bounds for word in pair]
    safe = [word.replace("\0", "") for word in words]  # no program can receive a NUL
    return Case("command", "", (), False, tuple(word[:100_000] for word in safe))


def option_values(name: str) -> st.SearchStrategy[str]:
    """Return a strategy of values for an option."""
    if name in ("out", "output", "run_dir", "folder", "video", "picture"):
        return st.sampled_from(PATHS)
    if name == "settings":
        text = st.builds(
            lambda key, value: f"{key}={value}", st.sampled_from(values.NAMES), st.sampled_from(values.YAML)
        )
        return st.one_of(st.sampled_from(SETTINGS), text)
    if name in BOUNDS or name in (
        "seed",
        "threads",
        "cpus",
        "memory",
        "goal",
        "speed",
        "timestep",
        "clock_frequency",
        "threshold",
    ):
        return st.sampled_from(NUMBERS)
    return st.one_of(st.sampled_from((*FILES, *values.NAMES)), st.text(max_size=20))

"""Run commands of ``frobs`` on thousands of damaged and hostile inputs: ``make fuzz``.

Hypothesis draws the inputs and the command lines. Each command runs in a process of its own that was forked from one that
has imported everything. The run is a fault if it prints a traceback or control characters, ends without one clear error
line or with an exit code other than 0, 1 and 2, takes more than 5 s of processor time unless it simulates or trains, grows
by more than 1 GB, executes something or writes outside its folders::

    python tests/fuzz/fuzz.py --inputs 3000
    python tests/fuzz/fuzz.py --seconds 600 --seed 7 --kind bundle run
    python tests/fuzz/fuzz.py --repeat build/fuzz/hang_0

Exits with status 1 if there are faults. Their inputs, commands and outputs are in ``build/fuzz``, one folder each.
"""

from __future__ import annotations

import json
import shlex
import shutil
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from cases import RARE, Case, Commands, build, command_lines, file_cases
from hypothesis import HealthCheck, Phase, Verbosity, given, settings
from hypothesis import seed as seeded
from seeds import KINDS, Seed, make
from server import Server
from verdicts import Fault, events, judge

SHARES = {"command": 4, "robot": 5, "mesh": 3, "yaml": 3, "bundle": 5, "run": 5, "model": 1, "package": 1}
"""Share of each kind in the inputs."""

BATCH = 25
"""Number of inputs that Hypothesis draws together."""

KEPT = 2
"""Number of examples that are stored of faults that probably have the same cause."""


@dataclass
class Fuzzer:
    """Runs cases and collects faults.

    Attributes:
        server: Server that runs the commands.
        folder: Temporary folder.
        kept: Folder for the inputs with faults.
        corpus: Inputs by kind.
        commands: Installed commands.
        expected: Events of valid inputs.
        count: Number of cases by kind.
        groups: Faults by their group.
    """

    server: Server
    folder: Path
    kept: Path
    corpus: Mapping[str, Sequence[Seed]]
    commands: Commands
    expected: frozenset[str] = frozenset()
    count: Counter[str] = field(default_factory=Counter)
    codes: Counter[str] = field(default_factory=Counter)
    groups: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    seconds: float = 0.0

    def learn(self, kinds: Sequence[str]) -> None:
        """Run commands on valid inputs: to import what they need, and to see which events are ordinary."""
        found: set[str] = set()
        for kind in kinds:
            for words in dict.fromkeys(self.commands.templates(kind)):
                if f"frobs {words[0]}" not in RARE or words[0] in ("export", "tune"):
                    result, _ = self.run(Case(kind, self.corpus[kind][0].name, (), False, words), cpu=60.0)
                    self.server.preload(result["modules"])
                    if result["code"] != 0:
                        self.commands.refused.add((kind, words))
                    found |= events(result)
        self.expected = frozenset(found)

    def run(self, case: Case, **limits: float) -> tuple[dict[str, Any], list[str]]:
        """Run a case and return the result and the command line."""
        place = self.folder / "case"
        words = build(case, self.corpus, place)
        return self.server.run(place, words, **limits), words

    def check(self, case: Case) -> list[Fault]:
        """Run a case and store its faults."""
        result, words = self.run(case)
        self.count[case.kind] += 1
        self.codes[result["killed"] or f"exit code {result['code']}"] += 1
        self.seconds += result["cpu"]
        faults = judge(case, words, result, self.expected)
        for fault in faults:
            known = self.groups.setdefault(fault.group, [])
            if len(known) < KEPT:
                shortest = self.shorten(case, fault)
                known.append(self.store(shortest, fault, len(self.groups)))
            else:
                known.append("")
        return faults

    def shorten(self, case: Case, fault: Fault) -> Case:
        """Drop mutations and words that the fault does not need."""
        for index in range(len(case.mutations) - 1, -1, -1):
            shorter = replace(case, mutations=case.mutations[:index] + case.mutations[index + 1 :])
            if self._repeats(shorter, fault):
                case = shorter
        if case.kind == "command":
            for index in range(len(case.words) - 1, 0, -1):
                shorter = replace(case, words=case.words[:index] + case.words[index + 1 :])
                if self._repeats(shorter, fault):
                    case = shorter
        return case

    def _repeats(self, case: Case, fault: Fault) -> bool:
        result, words = self.run(case)
        return fault.group in {found.group for found in judge(case, words, result, self.expected)}

    def store(self, case: Case, fault: Fault, number: int) -> str:
        """Write the input, the command and the output of a fault into a folder, and return its name."""
        name = f"{fault.symptom.replace(' ', '_')}_{number}_{len(self.groups[fault.group])}"
        place = self.kept / name
        result, words = self.run(case)
        build(case, self.corpus, place)
        for file in ("stdout", "stderr", "stack"):
            (place / file).write_text(result[file], encoding="utf-8", errors="surrogateescape")
        (place / "case.json").write_text(json.dumps(case.as_data(), indent=1))
        (place / "fault.json").write_text(json.dumps(vars(fault) | {"cpu": result["cpu"], "words": words}, indent=1))
        (place / "command.sh").write_text(
            f"cd {place / 'work'} && frobs {shlex.join(words)}\n", errors="surrogateescape"
        )
        return name

    def report(self) -> str:
        """Return the summary."""
        kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(self.count.items()))
        outcomes = ", ".join(f"{count} {code}" for code, count in self.codes.most_common())
        lines = [f"{self.count.total():,} inputs ({kinds}) in {self.seconds:,.0f} s of processor time: {outcomes}"]
        if not self.groups:
            return "\n".join([*lines, "no faults"])
        for (symptom, where), names in sorted(self.groups.items(), key=lambda item: (item[0][0], -len(item[1]))):
            first = json.loads((self.kept / names[0] / "fault.json").read_text())
            example = shlex.join(first["words"])
            lines.append(
                f"{len(names):4d} × {symptom} in {where}: {first['detail']!r}\n       {names[0]}: frobs {example[:160]!r}"
            )
        faults = sum(map(len, self.groups.values()))
        return "\n".join(
            [*lines, f"{faults} faults of {len(self.groups)} groups; inputs and outputs are in {self.kept}"]
        )


def fuzz(
    fuzzer: Fuzzer, inputs: int, seed: int = 0, seconds: float = float("inf"), kinds: Sequence[str] = tuple(SHARES)
) -> None:
    """Draw and run cases of all kinds in turns, until their number or the time [s] is reached."""
    deadline = time.monotonic() + seconds
    total = sum(SHARES[kind] for kind in kinds)
    quotas = {kind: max(1, round(inputs * SHARES[kind] / total)) for kind in kinds}
    batch = 0
    while any(quotas.values()) and time.monotonic() < deadline:
        for kind in kinds:
            size = min(BATCH, quotas[kind])
            quotas[kind] -= size
            strategy = (
                command_lines(fuzzer.commands)
                if kind == "command"
                else file_cases(kind, fuzzer.corpus, fuzzer.commands)
            )
            if size and time.monotonic() < deadline:
                draw_cases(strategy, size, 1000 * seed + batch, fuzzer.check, deadline)
        batch += 1


def draw_cases(strategy: Any, size: int, seed: int, run: Callable[[Case], object], deadline: float) -> None:
    """Draw cases and run each."""

    @seeded(seed)
    @settings(
        max_examples=size,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        verbosity=Verbosity.quiet,
    )
    @given(strategy)
    def each(case: Case) -> None:
        if time.monotonic() < deadline:
            run(case)

    each()


def started(server: Server, folder: Path, kept: Path, kinds: Sequence[str] = tuple(SHARES)) -> Fuzzer:
    """Return a fuzzer that knows the installed commands and has made its inputs."""
    from frobs_cli.program import walk

    fuzzer = Fuzzer(server, folder, kept, make(server, folder / "corpus"), Commands(walk()))
    fuzzer.learn([kind for kind in KINDS if kind in kinds or "command" in kinds])
    return fuzzer


def progress(fuzzer: Fuzzer) -> Iterator[None]:
    """Print the number of inputs and faults every hundred inputs."""
    check = fuzzer.check

    def checked(case: Case) -> list[Fault]:
        faults = check(case)
        if fuzzer.count.total() % 100 == 0:
            sys.stderr.write(f"{fuzzer.count.total()} inputs, {len(fuzzer.groups)} groups of faults\n")
        return faults

    fuzzer.check = checked  # type: ignore[method-assign]
    yield


def main() -> int:
    """Fuzz, print the summary, and return 1 if there are faults."""
    root = Path(__file__).parents[2]
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--inputs", type=int, default=3000, help="number of inputs")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after this time [s]")
    parser.add_argument("--seed", type=int, default=0, help="seed of the inputs")
    parser.add_argument("--kind", nargs="+", choices=SHARES, default=list(SHARES), help="only inputs of these kinds")
    parser.add_argument("--out", type=Path, default=root / "build" / "fuzz", help="folder for the inputs with faults")
    parser.add_argument("--repeat", type=Path, help="run the case of this folder again, and print its output")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary, Server() as server:
        folder = Path(temporary)
        if chosen.repeat is None:
            shutil.rmtree(chosen.out, ignore_errors=True)
        fuzzer = started(server, folder, chosen.out, chosen.kind)
        if chosen.repeat is not None:
            case = Case.from_data(json.loads((chosen.repeat / "case.json").read_text()))
            result, words = fuzzer.run(case)
            faults = judge(case, words, result, fuzzer.expected)
            sys.stdout.write(
                f"frobs {shlex.join(words)}\n{result['stdout']}{result['stderr']}{result['stack']}{faults}\n"
            )
            return int(bool(faults))
        for _ in progress(fuzzer):
            fuzz(fuzzer, chosen.inputs, chosen.seed, chosen.seconds, chosen.kind)
        sys.stdout.write(f"{fuzzer.report()}\n")
    return int(bool(fuzzer.groups))


if __name__ == "__main__":
    sys.exit(main())

"""Plant all faults, ask the kit, and write ``docs/reference/planted-faults.md``: ``python tests/planted_faults/plant.py``."""

from __future__ import annotations

import importlib
import json
import sys
from argparse import ArgumentParser
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import by_hand
import mutator
import outsider
import survivors
from planting import ROOT, Fault, ask, source_of

PAGE = ROOT / "docs" / "reference" / "planted-faults.md"
SEED, DRAWN = 6, 45
FOREIGN = "## Written without reading the kit"
STRANGERS = "## Written by three authors who had not read the kit"

Row = tuple[Fault, str | None]


def measure(faults: Iterable[Fault]) -> list[Row]:
    """Return what catches each fault, and say so on stderr as it goes."""
    rows = []
    for fault in faults:
        caught = ask(fault)
        sys.stderr.write(f"{fault.module:40} {fault.name:60} {caught or 'SURVIVES'}  {fault.where}\n")
        rows.append((fault, caught))
    return rows


def serve() -> None:
    """Answer each line of stdin, a part of a module's or a fault's name, with JSON: a list of (fault, what catches it)."""
    written = [*by_hand.faults(), *(fault for package in outsider.PACKAGES for fault in outsider.faults(package))]
    for line in sys.stdin:
        faults = [fault for fault in written if line.strip() in f"{fault.module} {fault.name}"]
        if any(".algorithm." in fault.module for fault in faults):  # import others' large libraries before the fork
            for library in ("stable_baselines3", "torch._dynamo"):
                importlib.import_module(library)
        sys.stdout.write(json.dumps([(fault.name, caught) for fault, caught in measure(faults)]) + "\n")
        sys.stdout.flush()


def expect_sound(faults: Iterable[Fault]) -> None:
    """Plant nothing in a module of each package, and see that nothing is caught: else every fault would be."""
    modules = {fault.module.partition(".")[0]: fault.module for fault in faults}
    own = [module for package, module in modules.items() if package not in outsider.PACKAGES]
    foreign = outsider.sound() if len(own) < len(modules) else ()
    for nothing in (*foreign, *(Fault("nothing", module, source_of(module), "") for module in own)):
        caught = ask(nothing)
        assert caught is None, f"{nothing.module}: '{caught}' fails without a fault"


def page(hand: Sequence[Row], drawn: Sequence[Row], foreign: Sequence[Row], strangers: Sequence[Row]) -> str:
    """Return the page."""
    rows = [*hand, *drawn]
    caught = sum(found is not None for _, found in rows)
    lines = [
        "# Planted faults",
        "",
        "How many mistakes does the conformance kit detect? To find out, we plant faults in the built-in simulator, "
        "controllers, tasks and environments, and in copies of the templates, and run the kit on each faulty version. "
        "`python tests/planted_faults/plant.py` does this and writes this page.",
        "",
        f"**{caught} of {len(rows)} faults are caught ({caught / len(rows):.0%})**: "
        f"{sum(found is not None for _, found in hand)} of {len(hand)} faults that were written by hand, and "
        f"{sum(found is not None for _, found in drawn)} of {len(drawn)} that were drawn at random (seed {SEED}).",
        "",
        "## Written by hand",
        "",
        "| fault | module | caught first by |",
        "|---|---|---|",
        *(f"| {fault.name} | `{fault.module}` | {_by(found)} |" for fault, found in hand),
        "",
        "## Drawn",
        "",
        "Each fault that was drawn at random is one change to a module's syntax tree. These changes are spread evenly over "
        f"{len(mutator.FILES)} files.",
        "",
        "| change | module | caught first by |",
        "|---|---|---|",
        *(f"| {fault.where.replace('|', chr(92) + '|')} | `{fault.module}` | {_by(found)} |" for fault, found in drawn),
        "",
        *foreign_lines(foreign),
        *strangers_lines(strangers),
        "## Survivors",
        "",
        "| change | module | why |",
        "|---|---|---|",
        *(
            f"| {fault.where.replace('|', chr(92) + '|')} | `{fault.module}` | {survivors.reason(fault)} |"
            for fault, found in rows
            if found is None
        ),
    ]
    return "\n".join(lines) + "\n"


def foreign_lines(rows: Sequence[Row]) -> list[str]:
    """Return the section of the page about faults by an author who had not read the kit."""
    caught = sum(found is not None for _, found in rows)
    return [
        FOREIGN,
        "",
        "An author who had read the templates and the interfaces, but not the source code of the kit, wrote eight faulty "
        "plugins of each kind. "
        f"**{len(outsider.FIRST_TRY)} of {len(rows)}** were caught by checks that existed at that time. The kit was then "
        f"improved; now **{caught} of {len(rows)}** are caught. Each plugin is one file in "
        "`tests/planted_faults/by_outsider/`.",
        "",
        *_table(rows, outsider.FIRST_TRY),
        "",
        "No plugin was caught because it crashed or could not be imported. Three plugins were at first caught for a reason "
        "other than the mistake that their author intended:",
        "",
        *(f"- `{file}`: {note}." for file, note in outsider.NOTES.items()),
        "",
    ]


def strangers_lines(rows: Sequence[Row]) -> list[str]:
    """Return the section of the page about faults by three authors who had not read the kit."""
    caught = sum(found is not None for _, found in rows)
    return [
        STRANGERS,
        "",
        f"For version 0.3, three authors wrote {len(rows)} faulty plugins, most of which extend shipped parts. The authors "
        "had read the tutorials, the interfaces and the shipped parts, but none of the checks. No check was written for "
        f"these faults before the first try. **{len(outsider.FIRST_TRY_OF_STRANGERS)} of {len(rows)}** were caught at the first "
        f"try, and **{caught} of {len(rows)}** are caught now. The files are in `tests/planted_faults/by_strangers/`.",
        "",
        *_table(rows, outsider.FIRST_TRY_OF_STRANGERS),
        "",
    ]


def _table(rows: Sequence[Row], at_first: Collection[str]) -> list[str]:
    return [
        "| fault | file | at first | caught first by |",
        "|---|---|---|---|",
        *(
            f"| {fault.name} | `{'/'.join(fault.module.split('.')[1:])}.py` | "
            f"{'caught' if fault.where in at_first else 'survived'} | "
            f"{_by(found) if found else f'**survives**: {survivors.reason(fault)}'} |"
            for fault, found in rows
        ),
    ]


def _by(found: str | None) -> str:
    if found is None:
        return "**survives**"
    return {"import": "its import", "crash": "the end of the process", "hangs": "a time limit"}.get(found, f"`{found}`")


def main() -> None:
    """Measure, and write the page."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument(
        "--only", default="", help="part of a module's or a fault's name: measured, and no page written"
    )
    parser.add_argument("--seed", type=int, default=SEED, help="of the faults that are drawn")
    parser.add_argument("--drawn", type=int, default=DRAWN, help="how many are drawn")
    parser.add_argument("--foreign", action="store_true", help="measure and write the sections of other authors only")
    parser.add_argument("--quick", action="store_true", help="do not make sure first that sound modules pass")
    parser.add_argument("--serve", action="store_true", help="measure what each line of stdin names")
    options = parser.parse_args()
    if options.serve:
        serve()
        return
    chosen = [[fault for fault in faults if options.only in f"{fault.module} {fault.name}"]
              for faults in (() if options.foreign else by_hand.faults(),
                             () if options.foreign else mutator.draw(options.drawn, options.seed),
                             *map(outsider.faults, outsider.PACKAGES))]  # fmt: skip
    if not options.quick:
        expect_sound(fault for faults in chosen for fault in faults)
    rows = [measure(faults) for faults in chosen]
    if options.only:
        return
    if options.foreign:
        before, _, after = PAGE.read_text("utf-8").partition(f"{FOREIGN}\n")
        before, rest = before.split("## Survivors") if not after else (before, after.split("## Survivors")[1])
        sections = [*foreign_lines(rows[2]), *strangers_lines(rows[3])]
        PAGE.write_text(before + "\n".join(sections) + "\n## Survivors" + rest, "utf-8")
    else:
        PAGE.write_text(page(*rows), "utf-8")


if __name__ == "__main__":
    main()

"""Plant all faults, ask the kit, and write ``docs/reference/planted-faults.md``: ``python tests/planted_faults/plant.py``."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import by_hand
import mutator
import survivors
from planting import ROOT, Fault, ask, source_of

PAGE = ROOT / "docs" / "reference" / "planted-faults.md"
SEED, DRAWN = 6, 45

Row = tuple[Fault, str | None]


def measure(faults: Iterable[Fault]) -> list[Row]:
    """Return what catches each fault, and say so on stderr as it goes."""
    rows = []
    for fault in faults:
        caught = ask(fault)
        sys.stderr.write(f"{fault.module:40} {fault.name:60} {caught or 'SURVIVES'}  {fault.where}\n")
        rows.append((fault, caught))
    return rows


def expect_sound(faults: Iterable[Fault]) -> None:
    """Plant nothing in a module of each package, and see that nothing is caught: else every fault would be."""
    modules = {fault.module.partition(".")[0]: fault.module for fault in faults}
    for module in modules.values():
        caught = ask(Fault("nothing", module, source_of(module), ""))
        assert caught is None, f"{module}: '{caught}' fails without a fault"


def page(hand: Sequence[Row], drawn: Sequence[Row]) -> str:
    """Return the page."""
    rows = [*hand, *drawn]
    caught = sum(found is not None for _, found in rows)
    lines = [
        "# Planted faults",
        "",
        "What the conformance kit is worth: faults are planted in the built-in simulator, controllers, tasks and "
        "environments, and the kit is asked. `python tests/planted_faults/plant.py` writes this page.",
        "",
        f"**{caught} of {len(rows)} are caught ({caught / len(rows):.0%})**: "
        f"{sum(found is not None for _, found in hand)} of {len(hand)} that were written by hand, "
        f"{sum(found is not None for _, found in drawn)} of {len(drawn)} that were drawn (seed {SEED}).",
        "",
        "## Written by hand",
        "",
        "| fault | module | caught first by |",
        "|---|---|---|",
        *(f"| {fault.name} | `{fault.module}` | {_by(found)} |" for fault, found in hand),
        "",
        "## Drawn",
        "",
        f"One change of the syntax tree each, from {len(mutator.FILES)} files in turn.",
        "",
        "| change | module | caught first by |",
        "|---|---|---|",
        *(f"| {fault.where.replace('|', chr(92) + '|')} | `{fault.module}` | {_by(found)} |" for fault, found in drawn),
        "",
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
    parser.add_argument("--quick", action="store_true", help="do not make sure first that sound modules pass")
    options = parser.parse_args()
    chosen = [[fault for fault in faults if options.only in f"{fault.module} {fault.name}"]
              for faults in (by_hand.faults(), mutator.draw(options.drawn, options.seed))]  # fmt: skip
    if not options.quick:
        expect_sound(fault for faults in chosen for fault in faults)
    rows = [measure(faults) for faults in chosen]
    if not options.only:
        PAGE.write_text(page(*rows), "utf-8")


if __name__ == "__main__":
    main()

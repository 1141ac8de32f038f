"""A sample of the planted faults; ``plant.py`` plants all of them, and writes the page."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import by_hand
import mutator
import outsider
import pytest
import survivors
from plant import DRAWN, FOREIGN, PAGE, SEED, STRANGERS
from planting import PARTS, source_of

MEASURE = Path(__file__).with_name("plant.py")
BY_HAND = list(by_hand.faults())
FOREIGN_FAULTS = list(outsider.faults("by_outsider"))
STRANGERS_FAULTS = list(outsider.faults("by_strangers"))
STRANGERS_CAUGHT = [fault for fault in STRANGERS_FAULTS if fault.where not in survivors.OF_STRANGERS]
FOREIGN_SAMPLE = ("tcp_at_the_elbow", "joints_by_alphabet")
SAMPLE = ("joints commanded in reverse order", "a joint limit ignored")
"""Caught within seconds, each by a check of another kind."""


def test_there_are_faults_of_every_part_and_each_compiles() -> None:
    assert len(BY_HAND) >= 20
    packages = {fault.module.partition(".")[0] for fault in BY_HAND}
    assert packages == {
        "frobs_sim_mujoco",
        "frobs_controllers",
        "frobs_tasks_reach",
        "frobs_core",
        "frobs_models",
        "templates",
    }
    for fault in BY_HAND:
        ast.parse(fault.source)
        assert fault.source != source_of(fault.module)


def test_parts_that_have_checks_of_their_own_are_modules() -> None:
    assert {*PARTS} <= {fault.module.rpartition(".")[2] for fault in BY_HAND}


@pytest.mark.slow
def test_the_same_seed_draws_the_same_and_changes_something() -> None:
    drawn, again, others = (list(mutator.draw(30, seed)) for seed in (1, 1, 2))
    assert drawn == again
    assert drawn != others
    for fault in drawn:
        assert ast.unparse(ast.parse(fault.source)) != ast.unparse(ast.parse(source_of(fault.module))), fault


@pytest.mark.parametrize(
    ("before", "kind", "after"),
    [
        ("x + 1", "operator", "x - 1"),
        ("x < 1", "comparison", "x <= 1"),
        ("-x", "sign", "+x"),
        ("np.minimum(x)", "function", "np.maximum(x)"),
        ("a if c else b", "branch", "b if c else a"),
    ],
)
def test_a_change_is_what_its_name_says(before: str, kind: str, after: str, monkeypatch: pytest.MonkeyPatch) -> None:
    source = f"def f():\n    return {before}\n"
    monkeypatch.setattr(mutator, "source_of", lambda module: source)
    places = [place for place in mutator._places(ast.parse(source)) if place[1] == kind]
    assert mutator.mutate("m", *places[0]).source == f"def f():\n    return {after}"


def test_the_page_says_that_enough_are_caught() -> None:
    text = PAGE.read_text("utf-8")
    by_hand_caught, hand, drawn_caught, drawn = map(
        int,
        re.search(
            r"(\d+) of (\d+) faults that were written by hand, and (\d+) of (\d+) that were drawn", text
        ).groups(),
    )
    assert by_hand_caught == hand == len(BY_HAND)
    assert drawn == DRAWN
    assert by_hand_caught + drawn_caught >= 0.9 * (hand + drawn)
    assert f"(seed {SEED})" in text
    assert "not looked at yet" not in text


def test_the_page_lists_every_fault_that_was_written_without_reading_the_kit() -> None:
    section = PAGE.read_text("utf-8").split(FOREIGN)[1].split("\n## ")[0]
    first, total, caught, again = map(
        int, re.search(r"\*\*(\d+) of (\d+)\*\* .* \*\*(\d+) of (\d+)\*\*", section).groups()
    )
    assert first == len(outsider.FIRST_TRY)
    assert total == again == len(FOREIGN_FAULTS) == 40
    assert caught >= 38
    for fault in FOREIGN_FAULTS:
        assert f"| {fault.name} |" in section


def test_the_page_lists_every_fault_of_the_three_authors() -> None:
    section = PAGE.read_text("utf-8").split(STRANGERS)[1].split("\n## ")[0]
    first, total, caught, again = map(
        int, re.search(r"\*\*(\d+) of (\d+)\*\* .* \*\*(\d+) of (\d+)\*\*", section).groups()
    )
    assert first == len(outsider.FIRST_TRY_OF_STRANGERS)
    assert total == again == len(STRANGERS_FAULTS) == 45
    assert caught == len(STRANGERS_CAUGHT)
    assert {fault.where for fault in STRANGERS_FAULTS} >= outsider.FIRST_TRY_OF_STRANGERS
    assert {fault.where for fault in STRANGERS_FAULTS} >= survivors.OF_STRANGERS.keys()
    assert "not looked at yet" not in section
    for fault in STRANGERS_FAULTS:
        assert f"| {fault.name} |" in section


def test_there_are_eight_foreign_faults_of_each_kind() -> None:
    kinds = [fault.module.split(".")[1] for fault in FOREIGN_FAULTS]
    assert {kind: kinds.count(kind) for kind in kinds} == dict.fromkeys(outsider.KINDS, 8)
    assert {fault.where for fault in FOREIGN_FAULTS} >= outsider.FIRST_TRY


@pytest.fixture(scope="module")
def plant() -> Iterator[Callable[[str], dict[str, str | None]]]:
    """Return what plants faults by a part of their names, in a process that has imported nothing of what is changed."""
    command = [sys.executable, str(MEASURE), "--serve"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdin is not None
        assert server.stdout is not None

        def ask(name: str) -> dict[str, str | None]:
            server.stdin.write(f"{name}\n")
            server.stdin.flush()
            return dict(json.loads(server.stdout.readline()))

        yield ask
        server.stdin.close()


@pytest.mark.parametrize("name", [*SAMPLE, *FOREIGN_SAMPLE])
def test_a_planted_fault_is_caught(name: str, plant: Callable[[str], dict[str, str | None]]) -> None:
    assert_caught(plant(name))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [*(fault.name for fault in BY_HAND), *(fault.where for fault in (*FOREIGN_FAULTS, *STRANGERS_CAUGHT))]
)
def test_every_fault_that_somebody_wrote_is_caught(name: str, plant: Callable[[str], dict[str, str | None]]) -> None:
    assert_caught(plant(name))


def assert_caught(found: dict[str, str | None]) -> None:
    assert found
    assert [fault for fault, check in found.items() if check is None] == []

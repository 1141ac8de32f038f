"""Answers that cover every pair of two questions' answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations as choose
from itertools import product

from frobs_devkit.scaffold import CHOICES, asked, find_problem

FILE = "<file>"
"""Stands for the robot file, of which each test has its own."""

_VALUES = {**CHOICES, "namespace": ("lab", "Acme_9"), "author": ("Your Name", "Zoë O'Brien & Søn")}
Pair = frozenset[tuple[str, str]]


def every_answer() -> Iterator[dict[str, str]]:
    """Yield all answers that are no mistake, without names."""
    seen = set()
    for row in product(*_VALUES.values()):
        answers = dict(zip(_VALUES, row, strict=True))
        questions = asked(answers)
        chosen = {question: answer for question, answer in answers.items() if question in questions}
        if frozenset(chosen.items()) not in seen and not find_problem(chosen):
            seen.add(frozenset(chosen.items()))
            yield chosen


def pairs(answers: Mapping[str, str]) -> set[Pair]:
    """Return the pairs of answers in a row."""
    return {frozenset(pair) for pair in choose([(q, a) for q, a in answers.items() if q in _VALUES], 2)}


def combinations() -> list[dict[str, str]]:
    """Return few rows that hold every pair there is, each with a name of its own: the greediest row first."""
    rows = list(every_answer())
    missing = set().union(*map(pairs, rows))
    chosen = []
    while missing:
        best = max(rows, key=lambda row: len(pairs(row) & missing))
        missing -= pairs(best)
        chosen.append(_completed(best, len(chosen)))
    return chosen


def _completed(answers: Mapping[str, str], number: int) -> dict[str, str]:
    completed = {**answers, "name": f"{answers['what']}_{number}"}
    if answers["what"] == "task":
        completed["robot"] = "irb120" if answers["example"] == "arm" else "my_rover"
    elif answers.get("example") == "file":
        completed["robot_file"] = FILE
    return completed


def label(answers: Mapping[str, str]) -> str:
    """Return a name for a test."""
    words = [answers[question] for question in ("what", "example", "license", "ci") if question in answers]
    return " ".join([*words, *["paced"] * (answers.get("paced") == "yes")])

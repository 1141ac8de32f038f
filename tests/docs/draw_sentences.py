"""Draw sentences at random from documentation, command help, docstrings and errors, for a reader to judge::

python tests/docs/draw_sentences.py --seed 1 --number 60
"""

from __future__ import annotations

import random
import re
import sys
from argparse import ArgumentParser
from collections.abc import Iterator

from pages import PAGES, ROOT
from test_plain_english import FENCE, SOURCES, python_files, texts

from frobs_cli.program import walk

SENTENCE = re.compile(r"(?<=[.!?])\s+(?=[A-Z`*])")
ENTRY = re.compile(r"\n\s*\n|\n\s+\w+: |: \n|\n(?=\s*- )")
"""Ends of the parts of a docstring: paragraphs, arguments and items."""
DIAGRAM = re.compile(r"\S {3,}\S|[├└│]")
"""Columns of a table, or branches of a tree."""


def sentences() -> Iterator[tuple[str, str]]:
    """Yield each sentence with its place."""
    for page in PAGES:
        for paragraph in re.split(r"\n\s*\n|\n(?=\s*[-|*#])", FENCE.sub("", page.read_text("utf-8"))):
            yield from split(page.relative_to(ROOT).as_posix(), paragraph.lstrip("#-*| "))
    for name, command in walk():
        for text in [command.help or "", *(getattr(parameter, "help", None) or "" for parameter in command.params)]:
            yield from split(f"help of {name}", text)
    for folder in SOURCES:
        for file in python_files(folder):
            for line, text in texts(file):
                yield from split(f"{file.relative_to(ROOT)}:{line}", text)


def split(place: str, text: str) -> Iterator[tuple[str, str]]:
    """Yield the sentences of a text that have at least six words."""
    parts = (part for part in ENTRY.split(text) if not DIAGRAM.search(part))
    for sentence in (each for part in parts for each in SENTENCE.split(" ".join(part.split()))):
        if len(re.findall(r"[A-Za-z]{2,}", sentence)) >= 6 and not re.search(r"::|\$ |\|", sentence):
            yield place, sentence


def main() -> None:
    """Write the sentences."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--number", type=int, default=60)
    parser.add_argument("--places", action="store_true", help="write the place of each sentence, too")
    given = parser.parse_args()
    drawn = random.Random(given.seed).sample(list(sentences()), given.number)
    for number, (place, sentence) in enumerate(drawn, 1):
        sys.stdout.write(f"{number}. {f'[{place}] ' if given.places else ''}{sentence}\n")


if __name__ == "__main__":
    main()

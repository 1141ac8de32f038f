"""Finds phrases that plain English avoids, in documentation, command help, docstrings, comments and messages."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest
from pages import PAGES, ROOT

from frobs_cli.program import walk

SOURCES = (
    "frobs_core",
    "templates",
    "cookiecutter",
    "examples",
    "plugins/frobs-cli/src",
    "plugins/frobs-devkit/src",
    "plugins/frobs-sim-mujoco/src",
    "plugins/frobs-sim-pybullet/src",
    "plugins/frobs-sim-gazebo/src",
    "plugins/frobs-controllers/src",
    "plugins/frobs-controllers-planning/src",
    "plugins/frobs-grippers/src",
    "plugins/frobs-robots-abb/src",
    "plugins/frobs-robots-franka/src",
    "plugins/frobs-robots-kobuki/src",
    "plugins/frobs-robots-so101/src",
    "plugins/frobs-robots-ur/src",
    "plugins/frobs-tasks-reach/src",
    "plugins/frobs-tasks-navigation/src",
    "plugins/frobs-tasks-manipulation/src",
    "plugins/frobs-tasks-legacy/src",
    "plugins/frobs-data/src",
    "plugins/frobs-deploy/src",
    "plugins/frobs-ros/src",
    "plugins/frobs-rl-compat/src",
    "plugins/frobs-train/src",
    "plugins/frobs-ros2/src",
    "plugins/frobs-view/src",
    "plugins/frobs-algos-imitation/src",
    "plugins/frobs-algos-sb3/src",
    "plugins/frobs-algos/src",
    "plugins/frobs-algos-sbx/src",
    "plugins/frobs-ray/src",
    "plugins/lerobot_env_frobs/src",
)
"""Folders whose docstrings, comments and strings are checked."""

PROSE = [*PAGES, *sorted(ROOT.glob("plugins/*/README.md")), *sorted(ROOT.glob("templates/**/*.md"))]
"""Pages that are checked."""

PHRASES = {
    r"\banew\b": "again",
    r"\bmend(s|ed|ing)?\b": "fix",
    r"\b(who|what)ever (is|stands|wants|goes)\b": "name the person or the thing",
    r"\bsomebody or something\b": "name the person or the program",
    r"\bgo(es)? on\b|\bwent on\b": "continue",
    r"\bstands? (in for|beside|behind|below|in the way)\b": "replace, be listed, be in",
    r"\b(is|are|was|were) told\b": "receive, be given",
    r"\btells (it|which|what|how|whether|the)\b": "report, return, state",
    r"\b(?<!there )(is|are) no (?!longer|more|less|greater|fewer|larger|smaller|farther|such)\w+": "is not a",
    r"\bwhich mirrors\b": "begin with the noun",
    r"\bway-points?\b": "waypoint",
}
"""Phrase, and what to write instead."""

BRITISH = re.compile(
    r"\b(\w*(behaviour|neighbour|colour|flavour|favour|honour|armour)(s|ed|ing|al)?"
    r"|(random|normal|initial|serial|organ|optim|recogn|summar|visual|real|general|minim|maxim|util|parametr|discret|special)"
    r"i(se|sed|ses|sing|sation|ser)"
    r"|centred|centring|(centi|milli|kilo)?metres?|grey|analyse[sd]?|licence|travelled|modelling|labelled|cancelled|artefacts?)\b",
    re.IGNORECASE,
)
FRAGMENT = re.compile(r"^(Of|What|Which|Whether) (?!to\b)[^?]*$")
CLAUSE = re.compile(r"(?:^|[.;] )What (?!to\b|if\b)[^?.:]*[.,;]")
ARGUMENT = re.compile(r"^ +\w+: ", re.MULTILINE)
FENCE = re.compile(r"^( *)(```+|:::+|~~~+).*?^\1\2$", re.MULTILINE | re.DOTALL)
FRONT_MATTER = re.compile(r"\A---\n.*?^---$", re.MULTILINE | re.DOTALL)
"""Settings of a page, which may contain British spellings as keywords of the search."""
LITERAL = re.compile(r"``[^`]*``|`[^`]*`|\S*[/_{}<>@]\S*|'[^' ]*'|\"[^\" ]*\"|\]\([^)]*\)")


def prose(text: str) -> str:
    """Return a text in one line, without code, names and paths."""
    return " ".join(LITERAL.sub(" ", ARGUMENT.sub(": ", text)).split())


def complaints(text: str) -> Iterator[str]:
    """Yield a description of each phrase that plain English avoids."""
    text = prose(text)
    if found := CLAUSE.search(text):
        yield f"'{found[0].strip()}' begins with a relative clause: begin with the noun"
    for phrase, better in PHRASES.items():
        for found in re.finditer(phrase, text, re.IGNORECASE):
            yield f"'{found[0]}' in '{text[max(found.start() - 40, 0) : found.end() + 30]}': {better}"
    for found in BRITISH.finditer(text):
        yield f"'{found[0]}': use the American spelling"


def texts(file: Path) -> Iterator[tuple[int, str]]:
    """Yield the docstrings, sentences in strings, and comments of a file of source code, each with its line.

    The fields of f-strings are replaced by ``{…}``. The lines of a comment are joined.
    """
    source = file.read_text("utf-8")
    parts: set[ast.AST] = set()
    for node in ast.walk(ast.parse(source)):  # f-strings before their parts
        if isinstance(node, ast.JoinedStr):
            parts.update(node.values)
            values = (each.value if isinstance(each, ast.Constant) else "{…}" for each in node.values)
            text = "".join(map(str, values))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in parts:
            text = node.value
        else:
            continue
        if text.count(" ") > 2:
            yield node.lineno, text
    start, comment = 0, ""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT:
            continue
        line, alone = token.start[0], token.line.strip().startswith("#")
        if comment and alone and line == start + comment.count("\n") + 1:
            comment += f"\n{token.string.lstrip('#')}"
            continue
        if comment:
            yield start, comment
        start, comment = line, token.string
    if comment:
        yield start, comment


def python_files(folder: str) -> Iterator[Path]:
    """Yield the Python files in a folder of the repository, without those that are cookiecutter templates."""
    for file in sorted((ROOT / folder).rglob("*.py")):
        text = file.read_text("utf-8")
        if "{{" not in text or not re.search(r"\{\{\s*cookiecutter\.|\{% ", text):
            yield file


def report(found: list[str]) -> None:
    """Fail if there is a complaint."""
    assert not found, "\n".join(found)


@pytest.mark.parametrize("folder", SOURCES)
def test_sources_use_plain_english(folder: str) -> None:
    report(
        [
            f"{file.relative_to(ROOT)}:{line}: {complaint}"
            for file in python_files(folder)
            for line, text in texts(file)
            for complaint in complaints(text)
        ]
    )


@pytest.mark.parametrize("page", PROSE, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_pages_use_plain_english(page: Path) -> None:
    text = FENCE.sub("", FRONT_MATTER.sub("", page.read_text("utf-8")))
    paragraphs = re.split(r"\n\s*\n|\n(?=\s*[-|*#])", text)
    report([complaint for paragraph in paragraphs for complaint in complaints(paragraph.lstrip("#-*| "))])


def test_help_uses_plain_english() -> None:
    found = []
    for name, command in walk():
        helps = [command.help or "", *(getattr(parameter, "help", None) or "" for parameter in command.params)]
        found += [f"{name}: '{text}' is a fragment: begin with a noun" for text in helps if FRAGMENT.match(text)]
        found += [f"{name}: {complaint}" for text in helps for complaint in complaints(text)]
    report(found)


@pytest.mark.parametrize(
    "text", ["What is not given is as tuned.", "the run goes on", "Train it anew.", "is no robot", "a grey behaviour"]
)
def test_the_dialect_is_found(text: str) -> None:
    assert list(complaints(text))


@pytest.mark.parametrize(
    "text", ["What is a task?", "It is no longer used.", "`colour` sets the color", "What to check:"]
)
def test_plain_english_is_not(text: str) -> None:
    assert not list(complaints(text))

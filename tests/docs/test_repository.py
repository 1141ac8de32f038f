"""The words of the repository about itself: links, install lines, pinned versions."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))

import claims
from pages import DOCS, PAGES, ROOT, name

LINK = re.compile(r"\]\(([^)\s]+)\)")
INSTALL = (DOCS / "how-to" / "install.md").read_text("utf-8")
DISTRIBUTIONS = sorted(path.parent for path in ROOT.glob("plugins/*/pyproject.toml"))


@pytest.mark.parametrize("page", [*PAGES, *(path / "README.md" for path in DISTRIBUTIONS)], ids=name)
def test_links_between_files_resolve(page: Path) -> None:
    broken = []
    for target in LINK.findall(page.read_text("utf-8")):
        path = (page.parent / target.partition("#")[0]).resolve()
        generated = DOCS / "reference" / "generated" in path.parents
        if not target.startswith(("http", "#", "mailto:")) and not generated and not path.exists():
            broken.append(target)
    assert broken == []


@pytest.mark.parametrize("folder", DISTRIBUTIONS, ids=lambda path: path.name)
def test_the_readme_of_a_distribution_explains_it(folder: Path) -> None:
    text = (folder / "README.md").read_text("utf-8")
    assert text.startswith(f"# {folder.name}\n")
    assert len(text.split()) > 10


@pytest.mark.parametrize("folder", DISTRIBUTIONS, ids=lambda path: path.name)
def test_the_install_lines_name_every_distribution(folder: Path) -> None:
    assert f"-e plugins/{folder.name}" in INSTALL.replace("'", "")  # quotes hold extras together
    assert f"`{folder.name}`" in INSTALL


def test_the_readme_quotes_the_measurements_that_it_links_to() -> None:
    text = " ".join((ROOT / "README.md").read_text("utf-8").split())
    quotes = re.findall(r"\[([^]]+)\]\(([^)]+-measured\.md)\)", text)
    assert len(quotes) >= 8
    stale = [
        (number, page)
        for text, page in quotes
        for number in re.findall(r"\b\d(?:[\d.,]*\d)?%?", text)
        if not re.search(rf"(?<![\d.,]){re.escape(number)}", (ROOT / page).read_text("utf-8"))
    ]
    assert stale == []


def test_the_chart_of_the_readme_shows_the_stored_measurements() -> None:
    with Image.open(claims.TARGET) as chart:
        assert chart.info["Description"] == claims.description(), "run 'python docs/claims.py'"


def test_the_readme_of_the_tests_describes_every_folder() -> None:
    tests = ROOT / "tests"
    folders = {path.name for path in tests.iterdir() if any(path.glob("test_*.py"))}
    rows = re.findall(r"^\| `(\w+)/` \| .+ \|$", (tests / "README.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(rows) == sorted(folders)


def test_requirements_are_pinned() -> None:
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in _lines("constraints.txt")}
    required = [*_lines("requirements-dev.txt"), *_lines("docs/requirements.txt")]
    wanted = {re.split(r"[;\[]", line)[0].strip().lower() for line in required if not line.startswith("--")}
    for project in [ROOT, *DISTRIBUTIONS]:
        table = tomllib.loads((project / "pyproject.toml").read_text("utf-8"))["project"]
        for group in (table["dependencies"], *table.get("optional-dependencies", {}).values()):
            wanted |= {re.split(r"[<>=\[; ]", requirement)[0].lower() for requirement in group}
    assert {want for want in wanted if "frobs" not in want} - pinned == set()
    assert "torch==2.13.0" in _lines("constraints.txt")


def test_distributions_share_one_version() -> None:
    projects = [
        tomllib.loads((path / "pyproject.toml").read_text("utf-8"))["project"] for path in [ROOT, *DISTRIBUTIONS]
    ]
    assert len({project["version"] for project in projects}) == 1


def test_make_explains_every_target_and_the_readme_only_names_targets() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    targets = set(re.findall(r"^([a-z-]+):.*## ", makefile, re.MULTILINE))
    assert targets == set(re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)[1].split())
    shown = subprocess.run(["make", "-C", ROOT, "help"], text=True, capture_output=True, check=True).stdout
    assert all(f"make {target} " in shown for target in targets)
    for page in PAGES:
        named = set(re.findall(r"`make ([a-z-]+)`", page.read_text("utf-8")))
        assert named <= targets, name(page)


def _lines(file: str) -> list[str]:
    lines = (ROOT / file).read_text("utf-8").splitlines()
    return [line.strip() for line in lines if line.strip() and not line.startswith("#")]

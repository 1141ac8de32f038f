from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from optional_parts import is_here
from pages import PAGES, ROOT, RUN, Block, blocks, name
from reader_environment import ReaderEnvironment
from run_blocks import SHORTER
from sandbox import Sandbox

FILES = Path(__file__).with_name("files")
"""Files that pages assume a reader to have: models of robots, in the folder in which the reader works."""

DRIVER = Path(__file__).with_name("run_blocks.py")


def typed(page: Path) -> list[Block]:
    """Return the blocks of a page that are run."""
    return [block for block in blocks(page) if block.language in RUN and "skip" not in block.attributes]


RUNNABLE = [page for page in PAGES if typed(page)]
INSTALLING = [
    page for page in RUNNABLE if any("pip install" in block.text for block in typed(page) if block.language == "bash")
]
"""Pages that install something, and so are run in an environment of their own."""

EMPTY = [page for page in INSTALLING if any(block.attributes.get("venv") == "empty" for block in typed(page))]
"""Pages whose reader starts without FRobs. The others start after ``make install``."""

EVERYTHING = [path.parent.name for path in ROOT.glob("plugins/*/pyproject.toml")]
"""The distributions that ``make install`` installs."""

QUICK = ("api-stability", "forces", "install", "many-environments", "model-files", "port-from-0.1", "ros", "scenes")
"""Pages whose blocks take at most three seconds. The others are run in the slow tests."""


def needs(page: Path) -> list[str]:
    """Return the parts of a machine that blocks of a page need."""
    return sorted({part for block in typed(page) for part in block.attributes.get("needs", "").split()})


def pages(*, installing: bool) -> Iterator[Any]:
    """Yield each page once, or twice if parts are missing: without the blocks that need them, and, skipped, with them."""
    for page in RUNNABLE:
        if (page in INSTALLING) is installing:
            marks = [] if page.stem in QUICK else [pytest.mark.slow]
            missing = [part for part in needs(page) if not is_here(part)]
            if missing:
                yield pytest.param(page, missing, id=f"{name(page)}-without-{'-'.join(missing)}", marks=marks)
            yield pytest.param(page, [], id=name(page), marks=[*marks, pytest.mark.needs(*needs(page))])


def run(page: Path, environment: Sandbox, folder: Path, without: Sequence[str] = ()) -> None:
    shutil.copytree(FILES, folder)
    left_out = ["--without", *without] if without else []
    environment.run("python", "-W", "error", DRIVER, page, *left_out, cwd=folder)


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ReaderEnvironment]:
    """The environment of readers who have installed FRobs."""
    folder = tmp_path_factory.mktemp("reader")
    environment = ReaderEnvironment(folder / "venv", *EVERYTHING)
    with environment.faster(folder / "programs"):
        yield environment


@pytest.mark.parametrize(("page", "without"), list(pages(installing=False)))
def test_pages_run_as_typed(page: Path, without: list[str], shared: ReaderEnvironment, tmp_path: Path) -> None:
    run(page, shared, tmp_path / "here", without)


@pytest.mark.parametrize(("page", "without"), list(pages(installing=True)))
def test_pages_that_install_run_as_typed_in_an_environment_of_their_own(
    page: Path, without: list[str], tmp_path: Path
) -> None:
    environment = ReaderEnvironment(tmp_path / "venv", *([] if page in EMPTY else EVERYTHING))
    with environment.faster(tmp_path / "programs"):
        run(page, environment, tmp_path / "here", without)


def test_a_terminal_keeps_its_folder_and_variables_between_blocks(shared: ReaderEnvironment, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "```bash\nmkdir inner\ncd inner\nexport NAME=value\n```\n"
        "```python\nfrom pathlib import Path\nPath('written').touch()\n```\n"
        "```bash\ntest $NAME = value\nls written\n```\n"
    )
    run(page, shared, tmp_path / "here")
    assert (tmp_path / "here" / "inner" / "written").exists()


@pytest.mark.parametrize("package", ["pytest", "hypothesis", "wandb", "minari"])
def test_readers_have_only_what_they_installed(package: str, shared: ReaderEnvironment) -> None:
    done = shared.run("python", "-c", f"import {package}", check=False)
    assert f"No module named '{package}'" in done.stderr


def test_from_frobs_new_to_a_trained_policy_takes_five_commands() -> None:
    page = next(page for page in INSTALLING if page.name == "own-plugin.md")
    text = page.read_text("utf-8")
    end = text[: text.index("\n## ")].count("\n")
    commands = [block for block in typed(page) if block.language == "bash" and block.line < end]
    lines = [line for block in commands for line in block.text.splitlines()]
    assert [line.split()[0:2] for line in lines if line.startswith("frobs")] == [
        ["frobs", "new"],
        ["frobs", "train"],
        ["frobs", "evaluate"],
    ]
    assert len(lines) == 5
    assert "five commands" in text


def test_every_shorter_training_is_on_its_page() -> None:
    texts = {page.name: page.read_text("utf-8") for page in PAGES}
    assert [(page, text) for page, shorter in SHORTER.items() for text in shorter if text not in texts[page]] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_say_what_language_they_are_in(page: Path) -> None:
    assert [f"{name(page)}:{block.line}" for block in blocks(page) if not block.language] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_that_are_not_run_say_why(page: Path) -> None:
    left_out = [block for block in blocks(page) if "skip" in block.attributes]
    assert [f"{name(page)}:{block.line}" for block in left_out if len(block.attributes["skip"]) < 10] == []


def test_most_pages_with_code_are_run() -> None:
    assert len(RUNNABLE) >= 7

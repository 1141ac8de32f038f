"""The built site: no warning, nothing from outside, and everything public in its reference."""

from __future__ import annotations

import dataclasses
import fcntl
import os
import re
import subprocess
import sys
import zlib
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest
from pages import ROOT
from test_commands_documented import COMMANDS
from test_documented import DATACLASSES, ERRORS, HOOKS, short

from frobs_core import plugins
from frobs_core.plugins import capabilities, registry
from frobs_core.plugins.records import KINDS, EnvironmentRecord

pytest.importorskip("sphinx", reason="the documentation is built with Sphinx; see requirements-dev.txt")

pytestmark = pytest.mark.slow(every=1)  # these tests build the documentation in CI


class Page(HTMLParser):
    """What a page links to, loads, and offers as anchors."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {key: value or "" for key, value in attrs}
        self.anchors |= {given[key] for key in ("id", "name") if key in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        self.loads += [given[key] for key in ("src", "srcset", "data") if key in given]
        if tag == "link" and given.get("rel") not in ("canonical", None):
            self.loads.append(given["href"])


def is_current() -> bool:
    """Return whether ``make docs`` succeeded after the last change of any file in the repository."""
    built = ROOT / "build" / "docs-built"
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(listed, cwd=ROOT, text=True, capture_output=True)
    files = [ROOT / file for file in done.stdout.split("\0") if file]
    if not files or not built.exists():
        return False
    return built.stat().st_mtime > max(file.lstat().st_mtime for file in files if file.exists())


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the site that ``make docs`` has built; build it if it is out of date, once for all workers."""
    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    with (shared / "site.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not is_current():
            command = ["make", "-C", ROOT, "--no-print-directory", "-o", ".venv/.installed-dev", "docs"]
            done = subprocess.run([*command, f"BIN={Path(sys.executable).parent}"], text=True, capture_output=True)
            assert not done.returncode, done.stderr
    return ROOT / "site"


@pytest.fixture(scope="module")
def site_pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path) for path in sorted(site.rglob("*.html"))}


@pytest.fixture(scope="module")
def reference(site: Path) -> str:
    return "\n".join(path.read_text("utf-8") for path in sorted((site / "reference").rglob("*.html")))


@pytest.fixture(scope="module")
def inventory(site: Path) -> set[str]:
    """Names of all Python objects that the site explains."""
    data = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    return {line.split()[0] for line in zlib.decompress(data).decode().splitlines() if " py:" in line}


def test_pages_load_nothing_from_outside(site: Path, site_pages: dict[Path, Page]) -> None:
    outside = re.compile(r"^(https?:)?//")
    assert [(path.name, what) for path, page in site_pages.items() for what in page.loads if outside.match(what)] == []
    for style in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*['\"]?(https?:)?//", style.read_text("utf-8")), style


def test_links_and_anchors_within_the_site_resolve(site_pages: dict[Path, Page]) -> None:
    broken = []
    for path, page in site_pages.items():
        for link in page.links:
            target, _, anchor = unquote(link).partition("#")
            if re.match(r"^[a-z]+:", target):
                continue
            file = (path.parent / target).resolve() if target else path
            file = file / "index.html" if file.is_dir() else file
            known = site_pages.get(file)
            if not file.exists() or (anchor and known and anchor not in known.anchors):
                broken.append(f"{path.name} → {link}")
    assert broken == []


def test_the_search_has_an_index(site: Path) -> None:
    assert "irb120reach" in (site / "searchindex.js").read_text("utf-8")


def test_generated_pages_show_no_markup_and_no_path_of_the_machine(site: Path) -> None:
    leak = re.compile(rf"\.cache/|{Path.home()}/|{ROOT}|(?<!`)``(?!`)|(?<!\w):\w+:`| at 0x[0-9a-f]+")
    found = []
    for path in sorted((site / "reference" / "generated").rglob("*.html")):
        text = unescape(re.sub(r"<[^>]+>", "", path.read_text("utf-8").partition("<article")[2]))
        found += [(path.name, text[max(match.start() - 40, 0) : match.end() + 40]) for match in leak.finditer(text)]
    assert found == []


def test_hooks_records_and_errors_are_in_the_reference(inventory: set[str]) -> None:
    wanted = [f"frobs_core.plugins.hooks.{short(hook)}" for hook in HOOKS]
    wanted += [f"{cls.__module__}.{cls.__name__}" for cls in (*DATACLASSES, *ERRORS)]
    assert sorted(set(wanted) - inventory) == []


def test_fields_are_in_the_reference(inventory: set[str], reference: str) -> None:
    for record in (*KINDS.values(), EnvironmentRecord):
        for field in dataclasses.fields(record):
            assert re.search(rf"\b{field.name}\b", reference), f"{record.__name__}.{field.name}"


def test_commands_and_flags_are_in_the_reference(site: Path) -> None:
    page = re.sub(r"<[^>]+>", "", (site / "reference" / "generated" / "commands.html").read_text("utf-8"))
    for name, command in COMMANDS:
        assert name in page
        for parameter in command.params:
            for flag in (*parameter.opts, *parameter.secondary_opts):
                if flag.startswith("--") and flag != "--help":
                    assert flag in page, f"{name} {flag}"


def test_environments_have_a_page_and_parts_a_section(site: Path, reference: str) -> None:
    folder = site / "reference" / "generated"
    for env_id in registry.environments():
        assert (folder / "environments" / f"{env_id.rpartition('/')[2].lower()}.html").exists()
    for kind in KINDS:
        for part in plugins.records(kind):
            assert f'id="{kind}-{part.replace("_", "-")}"' in reference, part


def test_capabilities_are_in_the_reference(site: Path) -> None:
    page = (site / "reference" / "generated" / "capabilities.html").read_text("utf-8")
    assert [name for name in capabilities.CAPABILITIES if name not in page] == []

"""The built site in headless Chromium: no sideways scrolling, no console error, no serious finding of axe."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from test_site import site as site

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is in requirements-dev.txt")
axe_playwright = pytest.importorskip("axe_playwright_python.sync_playwright", reason="see requirements-dev.txt")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.needs("browser"),
]

PAGES = (
    "index",
    "tutorials/first-robot",
    "how-to/index",
    "how-to/install",
    "how-to/train",
    "how-to/sensors",
    "how-to/randomize",
    "how-to/parity-measured",
    "explanation/architecture",
    "explanation/tasks-measured",
    "explanation/scaling-measured",
    "explanation/ros-measured",
    "benchmarks/index",
    "reference/index",
    "reference/generated/distributions",
    "reference/generated/environments",
    "reference/generated/environments/irb120reach-v0",
    "reference/generated/api/frobs_core.kernel.env",
    "reference/generated/capabilities",
    "glossary",
)
VIEWS = ((1280, "light", True), (1280, "dark", False), (390, "light", False), (390, "dark", True))
"""Width [pixels], color scheme, and whether axe computes contrasts, which takes most of its time."""
FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


class Quiet(SimpleHTTPRequestHandler):
    """A handler that prints nothing."""

    def log_message(self, *_: Any) -> None:
        """Print nothing."""


@pytest.fixture(scope="module")
def address(site: Path) -> Iterator[str]:
    """Serve the site, and return its address."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(site))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def tab(address: str) -> Iterator[Any]:
    """A tab of a browser."""
    with sync_api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser.new_page(base_url=address, reduced_motion="reduce")
        browser.close()


def findings(tab: Any, contrasts: bool) -> Iterator[str]:
    """Yield the serious findings of axe on the current page, and whether the page scrolls sideways."""
    wide = tab.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    if wide > 0:
        yield f"the page is {wide} pixels too wide"
    rules = {"color-contrast": {"enabled": contrasts}}
    found = axe_playwright.Axe().run(tab, options={"resultTypes": ["violations"], "rules": rules})
    for violation in found.response["violations"]:
        if violation["impact"] in ("serious", "critical"):
            yield f"{violation['id']}: {[node['html'][:200] for node in violation['nodes']]}"


@pytest.mark.parametrize("page", PAGES)
def test_pages_fit_and_are_accessible(tab: Any, page: str) -> None:
    errors: list[str] = []
    tab.on(
        "console",
        lambda message: errors.append(f"{message.text} {message.location}") if message.type == "error" else None,
    )
    tab.on("pageerror", lambda error: errors.append(str(error)))
    assert tab.goto(f"/{page}.html").ok
    tab.add_style_tag(content="* { transition: none !important }")  # axe would see colors that are between two schemes
    found = []
    for width, scheme, contrasts in VIEWS:
        tab.set_viewport_size({"width": width, "height": 900})
        tab.emulate_media(color_scheme=scheme)
        found += [f"{width} pixels, {scheme}: {finding}" for finding in findings(tab, contrasts)]
    assert found + errors == []


@pytest.mark.parametrize("words", ["reach", "train", "snapshot"])
def test_the_search_lists_guides_before_symbols(tab: Any, words: str) -> None:
    tab.goto(f"/search.html?q={words}")
    tab.wait_for_selector("#search-results p.search-summary:has-text('found')")
    links = tab.eval_on_selector_all("ul.search > li > a", "found => found.map(link => link.pathname)")
    guides = [link.startswith(("/how-to/", "/tutorials/")) for link in links]
    assert any(guides)
    assert not all(guides)
    assert guides == sorted(guides, reverse=True)


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("imitation", "/how-to/imitation.html"),
        ("behaviour cloning", "/how-to/imitation.html"),
        ("teleop", "/how-to/teleoperate.html"),
        ("ROS 2", "/how-to/ros2.html"),
        ("Gazebo", "/how-to/gazebo.html"),
        ("gripper", "/how-to/grippers.html"),
        ("camera", "/how-to/cameras.html"),
        ("sim2real", "/how-to/randomize.html"),
        ("GPU", "/how-to/come-from.html"),
        ("Isaac", "/how-to/come-from.html"),
    ],
)
def test_the_search_finds_what_newcomers_type(tab: Any, words: str, page: str) -> None:
    tab.goto(f"/search.html?q={words}")
    tab.wait_for_selector("#search-results p.search-summary:has-text('found')")
    links = tab.eval_on_selector_all("ul.search > li > a", "found => found.map(link => link.pathname)")
    assert page in links[:5]


def test_the_search_for_imitation_does_not_find_limitations(tab: Any) -> None:
    tab.goto("/search.html?q=imitation")
    tab.wait_for_selector("#search-results p.search-summary:has-text('found')")
    titles = tab.eval_on_selector_all("ul.search > li > a", "found => found.map(link => link.textContent)")
    assert titles
    assert not [title for title in titles if "limit" in title.lower()]


def test_pictures_follow_the_color_scheme_of_the_page(tab: Any) -> None:
    tab.emulate_media(color_scheme="light")
    tab.goto("/explanation/architecture.html")
    picture = tab.locator("figure.wide img").last
    picture.scroll_into_view_if_needed()
    tab.wait_for_function("document.querySelectorAll('figure.wide img')[1].complete")
    light = picture.screenshot()
    tab.evaluate("document.body.dataset.theme = 'dark'")
    assert picture.screenshot() != light


def test_readers_who_prefer_reduced_motion_see_stills(tab: Any) -> None:
    tab.goto("/index.html")
    assert tab.locator(".moving:visible").count() == 0
    assert tab.locator(".still:visible").count() > 1
    tab.emulate_media(reduced_motion="no-preference")
    assert tab.locator(".moving:visible").count() > 1
    tab.check("#pause")
    assert tab.locator(".moving:visible").count() == 0
    tab.emulate_media(reduced_motion="reduce")

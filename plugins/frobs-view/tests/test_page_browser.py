"""Static pages in headless Chromium, whose software OpenGL is slow: the tests wait for states, not for frames."""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from frobs_train import open_pretrained
from frobs_view.page import write_page

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is in requirements-dev.txt")
axe_playwright = pytest.importorskip("axe_playwright_python.sync_playwright", reason="see requirements-dev.txt")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [pytest.mark.slow, pytest.mark.needs("browser"), pytest.mark.needs("page")]

FLAGS = (
    *("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"),
)
READY = 3_000.0
"""Most time until a page runs on an idle machine [ms]."""


class Quiet(SimpleHTTPRequestHandler):
    """A handler that prints nothing."""

    def log_message(self, *_: Any) -> None:
        """Print nothing."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the pages ``push`` and ``reach``; do not change it."""
    folder = tmp_path_factory.mktemp("pages")
    write_page(open_pretrained("frobs/PandaPush-v0"), folder / "push", starts=10)
    write_page(open_pretrained("frobs/Irb120Reach-v0"), folder / "reach", starts=10)
    return folder


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with sync_api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def address(pages: Path) -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(pages))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class Page:
    """A tab with a page, and everything that it asked of the network or complained about."""

    def __init__(self, chromium: Any, address: str, name: str, *, width: int = 1000, scheme: str = "light") -> None:
        self.tab = chromium.new_page(viewport={"width": width, "height": 700}, color_scheme=scheme)
        self.asked: list[str] = []
        self.errors: list[str] = []
        self.tab.on("request", lambda request: self.asked.append(request.url))
        self.tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.goto(f"{address}/{name}/index.html")
        self.tab.wait_for_selector("body[data-state]", timeout=120_000)

    def read(self, expression: str) -> Any:
        """Return the value of an expression of the page's application."""
        return self.tab.evaluate(f"frobs.{expression}")

    def wait(self, condition: str, seconds: float = 120.0) -> None:
        """Let the page work until a condition holds."""
        self.tab.wait_for_function(condition, timeout=1000.0 * seconds)

    def place_of(self, point: list[float]) -> list[float]:
        """Return the place of a point of the world on the screen [pixels]."""
        place: list[float] = self.tab.evaluate(
            """point => {
              const { camera, canvas, goal } = frobs.drawing;
              camera.updateMatrixWorld();
              const p = goal.position.clone().set(...point).project(camera);
              const box = canvas.getBoundingClientRect();
              return [box.left + (p.x + 1) * box.width / 2, box.top + (1 - p.y) * box.height / 2];
            }""",
            point,
        )
        return place


@pytest.fixture
def open_page(chromium: Any, address: str) -> Iterator[Any]:
    opened: list[Page] = []

    def make(name: str, **view: Any) -> Page:
        opened.append(Page(chromium, address, name, **view))
        return opened[-1]

    yield make
    for page in opened:
        page.tab.close()


def test_a_page_is_ready_soon_counts_successes_and_asks_only_its_own_folder(open_page: Any, address: str) -> None:
    pages = [open_page("reach") for _ in range(2)]
    busy = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
    assert min(page.read("ready") for page in pages) <= busy * READY
    page = pages[-1]
    pages[0].tab.close()
    assert page.tab.text_content("h1") == "Irb120Reach-v0"
    page.wait("frobs.episodes >= 2")
    successes, episodes = page.read("successes"), page.read("episodes")
    assert 1 <= successes <= episodes
    page.wait("document.getElementById('outcome').textContent.startsWith('Episode ')")
    page.tab.click("#pause")
    page.wait(f"document.getElementById('successes').textContent === `${{frobs.successes}} of {page.read('episodes')}`")
    assert len(page.asked) >= 8
    assert [url for url in page.asked if not url.startswith((f"{address}/reach/", "data:", "blob:"))] == []
    assert page.errors == []


def test_a_page_works_with_the_keyboard(open_page: Any) -> None:
    page = open_page("push")
    page.tab.keyboard.press("Space")
    assert page.read("paused")
    assert page.tab.text_content("#pause") == "Resume"
    slider = page.tab.locator("#goal-x")
    slider.focus()
    before = page.read("simulation.goal")
    page.tab.keyboard.press("ArrowLeft" if before[0] > 0.5 else "ArrowRight")
    assert page.read("simulation.goal")[0] == pytest.approx(before[0] + (-0.01 if before[0] > 0.5 else 0.01))
    assert page.tab.locator("#goal-z").is_hidden()  # the goals of this task are on the floor
    for _ in range(100):
        page.tab.keyboard.press("ArrowRight")
    high = page.tab.evaluate("frobs.simulation.facts.goal.high[0]")
    assert page.read("simulation.goal")[0] == pytest.approx(high)
    camera = page.tab.evaluate("frobs.drawing.camera.position.toArray()")
    page.tab.focus("#view")
    page.tab.keyboard.press("ArrowLeft")
    assert page.tab.evaluate("frobs.drawing.camera.position.toArray()") != camera
    number = page.read("simulation.step_number")
    page.tab.keyboard.press("Space")
    page.wait(f"frobs.simulation.step_number > {number}")
    page.tab.keyboard.press("n")
    page.tab.keyboard.press("r")
    assert page.read("episodes") == 0
    assert page.errors == []


def test_a_push_moves_the_arm_and_ends(open_page: Any) -> None:
    page = open_page("reach")
    page.tab.keyboard.press("Space")
    page.tab.click("[data-push=up]")
    assert page.read("simulation.pull") is not None
    lifted = page.tab.evaluate(
        """async () => {  // with an arm that stays, but for the push
          frobs.policy.act = async () => [0, 0, 0, 0, 0, 0];
          const height = () => frobs.simulation.point(frobs.simulation.facts.tool)[2];
          const before = height();
          let most = 0;
          for (let i = 0; i < 20; i++) {
            await frobs.step();
            most = Math.max(most, height() - before);
          }
          return most;
        }"""
    )
    assert lifted > 0.002
    assert page.read("simulation.pull") is None
    assert not any(page.tab.evaluate("[...frobs.simulation.data.xfrc_applied]"))


def test_the_mouse_drags_the_goal_and_pulls_the_cube(open_page: Any) -> None:
    page = open_page("push")
    page.tab.keyboard.press("Space")
    page.tab.evaluate("frobs.simulation.setGoal([0.5, -0.14, 0.02]); frobs.drawing.draw()")
    start, end = page.place_of([0.5, -0.14, 0.02]), page.place_of([0.55, -0.1, 0.02])
    page.tab.mouse.move(*start)
    page.tab.mouse.down()
    page.tab.mouse.move(*end, steps=3)
    page.tab.mouse.up()
    assert page.read("simulation.goal") == pytest.approx([0.55, -0.1, 0.02], abs=0.01)
    assert page.read("simulation.pull") is None
    camera = page.tab.evaluate("frobs.drawing.camera.position.toArray()")
    cube = page.tab.evaluate(
        """() => {  // the start at which the cube is nearest to the camera, in front of the gripper
          const { simulation } = frobs;
          const place = number => (simulation.reset(number), simulation.point("cube"));
          const near = number => place(number)[0] - place(number)[1];
          const numbers = simulation.facts.starts.map((_, number) => number);
          return place(numbers.reduce((best, number) => (near(number) > near(best) ? number : best)));
        }"""
    )
    page.tab.evaluate("frobs.simulation.setGoal([0.62, 0.14, 0.02])")
    page.tab.mouse.move(*page.place_of(cube))
    page.tab.mouse.down()
    page.tab.mouse.move(*page.place_of([cube[0], cube[1] - 0.1, cube[2]]), steps=3)
    name = page.tab.evaluate("frobs.simulation.model.body(frobs.simulation.pull.body).name")
    assert name == "cube"
    page.tab.evaluate("frobs.policy.act = async () => [0, 0, 0, 0]")
    page.tab.keyboard.press("Space")
    page.wait(f"Math.abs(frobs.simulation.point('cube')[1] - {cube[1]}) > 0.02")
    page.tab.mouse.up()
    assert page.read("simulation.pull") is None
    assert page.tab.evaluate("frobs.drawing.camera.position.toArray()") == camera  # the view did not turn


@pytest.mark.parametrize(("width", "scheme"), [(1000, "light"), (390, "dark"), (390, "light"), (1000, "dark")])
def test_a_page_fits_and_is_accessible(open_page: Any, width: int, scheme: str) -> None:
    page = open_page("reach", width=width, scheme=scheme)
    page.tab.click("#pause")
    page.tab.click("summary")
    wide = page.tab.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    assert wide == 0
    found = axe_playwright.Axe().run(page.tab, options={"resultTypes": ["violations"]})
    serious = [one for one in found.response["violations"] if one["impact"] in ("serious", "critical")]
    assert [f"{one['id']}: {[node['html'][:200] for node in one['nodes']]}" for one in serious] == []


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("policy.onnx", b"no graph", "The policy failed"),
        ("mujoco.wasm.gz", b"\0asm no module", "The physics engine failed"),
        ("model.xml", b"<mujoco><no/></mujoco>", "The physics engine failed"),
        ("onnxruntime.wasm.gz", None, "The file onnxruntime.wasm.gz could not be loaded: the server answered 404"),
    ],
    ids=["policy", "physics", "model", "missing"],
)
def test_a_page_reports_a_failure_in_words(
    open_page: Any, pages: Path, name: str, content: bytes | None, text: str
) -> None:
    folder = pages / f"without {name}"
    shutil.copytree(pages / "reach", folder)
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)
    page = open_page(folder.name)
    assert page.tab.evaluate("document.body.dataset.state") == "failed"
    message = page.tab.get_by_role("alert").text_content()
    assert message.startswith("The simulation cannot run. ")
    assert text in message
    assert "Reload the page" in message


def test_a_page_that_is_opened_as_a_file_says_how_to_serve_it(chromium: Any, pages: Path) -> None:
    tab = chromium.new_page()
    tab.goto((pages / "reach" / "index.html").as_uri())
    tab.wait_for_selector("body[data-state=failed]", timeout=60_000)
    assert "python -m http.server" in tab.get_by_role("alert").text_content()
    tab.close()

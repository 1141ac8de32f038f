"""Draw the pictures of the view in the browser: ``python docs/screenshots.py``. Requires Chromium and Playwright."""

import shutil
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from playwright.sync_api import Page, sync_playwright

from frobs_core import load_policy
from frobs_view import BrowserViewer, Player, RobotPage, ViewServer

DOCS = Path(__file__).parent
SIZE = {"width": 1280, "height": 720}
FLAGS = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader")
STEPS = 126  # one episode and a part of the next
DRAWING = 20.0  # time that software OpenGL needs to draw the scene [s]


def screenshot(tab: Page, server: ViewServer, name: str, work: Callable[[], object]) -> None:
    """Write a picture of a page, and let the view work meanwhile."""
    tab.goto(server.address)
    tab.wait_for_selector("canvas")
    end = time.monotonic() + DRAWING
    while time.monotonic() < end:
        work()
        tab.wait_for_timeout(20)
    for notice in tab.get_by_role("alert").get_by_role("button").all():  # about software OpenGL
        notice.click()
    tab.wait_for_timeout(1_000)
    tab.screenshot(path=DOCS / "images" / name, timeout=120_000)


def draw_robot(tab: Page) -> None:
    """Draw the arm of the tutorial, with its wrong inertia."""
    page = (DOCS / "tutorials" / "look-at-your-robot.md").read_text("utf-8")
    text = page.partition('```xml file="my_arm.urdf"\n')[2].partition("```")[0]
    with tempfile.TemporaryDirectory() as folder, closing(ViewServer(title="FRobs: my_arm.urdf")) as server:
        file = Path(folder) / "my_arm.urdf"
        file.write_text(text, "utf-8")
        robot = RobotPage(str(file), server)
        robot.move(np.array([0.6, 0.5, 1.2]))
        screenshot(tab, server, "view-findings.png", robot.poll)


def draw_environment(tab: Page) -> None:
    """Draw the expert of pick and place."""
    env: Any = gym.make("frobs_core:frobs/PandaPickAndPlace-v0")
    with closing(ViewServer(title="FRobs: frobs/PandaPickAndPlace-v0")) as server:
        viewer = BrowserViewer(server)
        viewer.bind(env.unwrapped)
        with closing(Player(env, viewer, {"expert": lambda: load_policy("expert", env)})) as player:
            player.reset(3)

            def play() -> None:
                if player.steps < STEPS:
                    player.step()
                viewer.update()

            screenshot(tab, server, "view-expert.png", play)
    env.close()


def main() -> None:
    """Draw all pictures."""
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for draw in (draw_robot, draw_environment):
            with closing(browser.new_page(viewport=SIZE)) as tab:
                draw(tab)
        browser.close()


if __name__ == "__main__":
    main()

"""Measure what the view in the browser costs, and what it endures: ``docs/explanation/view-measured.md``.

The clients of the view speak as its page does, and draw nothing. Run the script on an idle machine, for about 25 minutes::

    python tests/benchmarks/view.py
    python tests/benchmarks/view.py --quick

Exits with status 1 if a goal is missed.
"""

from __future__ import annotations

import csv
import gc
import os
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from datetime import date
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium as gym

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2] / "plugins" / "frobs-view" / "tests"))

from common import ROOT, current_commit, is_shared, machine
from view_clients import PROTOCOL, open_socket, receive, wait_until
from websockets.exceptions import WebSocketException

from frobs_core import load_policy
from frobs_view import BrowserViewer, Player, ViewServer

PAGE = ROOT / "docs" / "explanation" / "view-measured.md"
ID = "frobs/PandaPickAndPlace-v0"
TRAINED, STEPS = "frobs/Irb120Reach-v0", 120_000
FEWEST_UPDATES, MOST_COST, LEAST_SPEED, MOST_GROWTH = 25.0, 1.5, 0.99, 20.0
WARM_UP, CONNECTS, CHANGES = 500, 10_000, 500


@contextmanager
def viewed() -> Iterator[tuple[ViewServer, Player]]:
    """Build an environment and its view, with the expert and random actions as policies."""
    env: Any = gym.make(f"frobs_core:{ID}")
    with closing(ViewServer()) as server:
        viewer = BrowserViewer(server)
        viewer.bind(env.unwrapped)
        makers = {name: lambda name=name: load_policy(name, env) for name in ("expert", "random")}
        player = Player(env, viewer, makers)
        player.reset(0)
        yield server, player
        player.close()
        env.close()


def cost_of_steps(player: Player, seconds: float, is_viewed: bool = True) -> tuple[float, int, int]:
    """Play in real time, and return the processor time [ms], the number of steps and the number of updates."""
    viewer = player._viewer
    start, steps, updates = time.process_time(), player.steps, viewer.updates
    end = time.monotonic() + seconds
    if is_viewed:
        player.run(lambda: time.monotonic() < end)
    else:
        count = int(seconds / player._timestep)
        for _ in range(count):
            player.step()
            time.sleep(player._timestep)
    return 1e3 * (time.process_time() - start), player.steps - steps, viewer.updates - updates


def update_cost(seconds: float) -> dict[str, float]:
    """Return the processor time of a step and of an update [ms], and the number of updates per second at a client.

    The time of an update is the time that this thread spends in it, and the time of all other threads. The client is a
    process of its own, because its time does not count.
    """
    with viewed() as (server, player):
        viewer = player._viewer
        callbacks = player._env.unwrapped.after_step
        cost_of_steps(player, 1.0, is_viewed=False)
        bare, steps, _ = cost_of_steps(player, seconds, is_viewed=False)
        in_updates = 0.0

        def update(result: Any) -> None:
            nonlocal in_updates
            start = time.thread_time()
            viewer.update()
            in_updates += time.thread_time() - start

        callbacks.append(update)
        alone, steps_alone, _ = cost_of_steps(player, seconds, is_viewed=False)
        with _reading(server.address):
            wait_until(lambda: server.has_clients)
            cost_of_steps(player, 2.0)
            in_updates, start = 0.0, time.thread_time()
            watched, _, updates = cost_of_steps(player, seconds)
            others = watched - 1e3 * (time.thread_time() - start)
    return {
        "step": bare / steps,
        "alone": alone / steps_alone,
        "update": (1e3 * in_updates + others) / updates,
        "rate": received_rate(seconds),
    }


def received_rate(seconds: float) -> float:
    """Return how often per second the pose of the last moving frame arrives at a client."""
    with viewed() as (server, player):
        player._env.unwrapped.after_step.append(lambda result: player._viewer.update())
        player._speed.value = 2.0  # more control steps per second than updates
        with closing(open_socket(server)) as client:
            running = True
            thread = threading.Thread(target=player.run, args=(lambda: running,))
            thread.start()
            receive(client, 2.0)
            messages = receive(client, seconds)
            running = False
            thread.join()
    names = [one["name"] for one in messages if one["type"] == "SetPositionMessage" and "/frame" in one["name"]]
    return max(map(names.count, set(names)), default=0) / seconds


@contextmanager
def _reading(address: str) -> Iterator[None]:
    code = (
        "import sys\nfrom websockets.sync.client import connect\n"
        "uri, origin, protocol = sys.argv[1:]\n"
        "with connect(uri, origin=origin, subprotocols=[protocol], max_size=None, proxy=None) as client:\n"
        "    for _ in client: pass\n"
    )
    uri, origin = address.replace("http://", "ws://"), address.rstrip("/")
    process = subprocess.Popen([sys.executable, "-c", code, uri, origin, PROTOCOL], stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def training_speed(steps: int, is_viewed: bool) -> float:
    """Return the environment steps per second of a training run, with a client on its view or without a view."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        words = ["train", TRAINED, "--steps", str(steps), "--seed", "0", "--run-dir", str(run)]
        command = [sys.executable, "-m", "frobs_cli", *words, *(["--view"] if is_viewed else [])]
        with subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
            assert process.stdout is not None
            addresses = (re.search(r"http://\S+/", line) for line in process.stdout)
            found = next(filter(None, addresses), None) if is_viewed else None
            if found is None:
                process.stdout.read()
            else:
                with _reading(found[0]):
                    process.stdout.read()
        with (run / "progress.csv").open(encoding="utf-8") as file:
            last = list(csv.DictReader(file))[-1]
    return float(last["train/steps"]) / float(last["time/elapsed"])


def endurance(part: int) -> dict[str, float]:
    """Connect, reset, swap policies and misbehave while the view plays, and return the resident memory [MB]."""
    with viewed() as (server, player):
        running = True
        thread = threading.Thread(target=player.run, args=(lambda: running,))
        thread.start()
        with closing(open_socket(server)):  # a client that never reads
            _connect(server, WARM_UP // part)
            after = resident()
            begun = player.steps
            for k in range(CHANGES // part):
                name = ("expert", "random")[k % 2]
                player._viewer.call(partial(player.choose, name))
                player._viewer.call(partial(player.reset, k))
                _connect(server, (CONNECTS - WARM_UP) // CHANGES)
                _send_malformed(server)
            wait_until(player._viewer._events.empty, 60.0)
            growth = resident() - after
            steps = player.steps - begun
        running = False
        thread.join()
    return {"after": after, "growth": growth, "steps": steps, "part": part}


def _connect(server: ViewServer, count: int) -> None:
    """Connect and disconnect, without waiting for the scene."""
    for _ in range(count):
        while True:
            try:
                with closing(open_socket(server)):
                    break
            except (OSError, WebSocketException):  # the server still has as many clients as it accepts
                time.sleep(0.05)


def _send_malformed(server: ViewServer) -> None:
    with suppress(OSError, WebSocketException), closing(open_socket(server)) as client:
        client.send(os.urandom(512))
        client.send(b"\x81\xa4type\xa3bad")


def resident() -> float:
    """Return the resident memory of this process [MB]."""
    gc.collect()
    try:
        pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
        return pages * resource.getpagesize() / 1e6
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def report(cost: Mapping[str, float], pairs: list[tuple[float, float]], load: Mapping[str, float], shared: bool) -> str:
    """Return the page.

    Args:
        cost: Result of :func:`update_cost`.
        pairs: Steps per second without and with a view, for each pair of training runs.
        load: Result of :func:`endurance`.
        shared: Whether other programs kept the machine busy.
    """
    busy = " **Other programs kept the machine busy, so these figures are too high.**" if shared else ""
    speed = median(watched / plain for plain, watched in pairs)

    def row(what: str, value: str, goal: str, met: bool) -> str:
        return f"| {what} | {value}{'' if met else ' (missed)'} | {goal} |"

    lines = [
        "# Benchmarks: view in the browser",
        "",
        f"Written by `tests/benchmarks/view.py` on {date.today():%d %B %Y}. Commit: {current_commit()}. Machine: "
        f"{machine()}.{busy} The scripted expert of `{ID}` acts. The clients receive what the page receives, and draw "
        "nothing.",
        "",
        "| what | measured | goal |",
        "|---|---:|---:|",
        row(
            "processor time of an update", f"{cost['update']:.2f} ms", f"≤ {MOST_COST} ms", cost["update"] <= MOST_COST
        ),
        row(
            "updates per second at a client",
            f"{cost['rate']:.1f}",
            f"≥ {FEWEST_UPDATES:.0f}",
            cost["rate"] >= FEWEST_UPDATES,
        ),
        row(
            f"steps per second of a training run with a view, relative to without (median of {len(pairs)} pairs)",
            f"{speed:.3f}",
            f"≥ {LEAST_SPEED}",
            speed >= LEAST_SPEED,
        ),
        row(
            "growth of the resident memory under load",
            f"{load['growth']:.1f} MB",
            f"≤ {MOST_GROWTH:.0f} MB",
            load["growth"] <= MOST_GROWTH,
        ),
        "",
        f"A step of the environment takes {cost['step']:.3f} ms of processor time without a view, and "
        f"{cost['alone']:.3f} ms with a view on which no page is open.",
        "",
        f"The training runs are of `{TRAINED}` with its default algorithm. Their steps per second, without and with a "
        f"view: {', '.join(f'{plain:.0f} and {watched:.0f}' for plain, watched in pairs)}.",
        "",
        f"Load: {CONNECTS // int(load['part']):,} connections, of which the first {WARM_UP // int(load['part']):,} come "
        f"before the first measurement of the memory ({load['after']:.0f} MB); {CHANGES // int(load['part'])} resets, "
        f"each with another policy and a client that sends malformed messages; and one "
        f"client that never reads. The policies made {load['steps']:.0f} steps meanwhile.",
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Measure, write the page, and return 1 if a goal is missed."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one pair of training runs, and a tenth of the load")
    quick = parser.parse_args().quick
    cost = update_cost(5.0 if quick else 20.0)
    count, steps = (1, STEPS // 4) if quick else (5, STEPS)
    pairs = [(training_speed(steps, False), training_speed(steps, True)) for _ in range(count)]
    page = report(cost, pairs, endurance(10 if quick else 1), is_shared())
    PAGE.write_text(page, "utf-8")
    return int("(missed)" in page)


if __name__ == "__main__":
    sys.exit(main())

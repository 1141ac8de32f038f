"""How a static page of 'frobs export --page' differs from Python on the same starts. 'make page' first::

    $ python tests/benchmarks/static_pages.py
    $ python tests/benchmarks/static_pages.py --episodes 20 frobs/PandaPush-v0

Prints a table: the largest deviation of positions in replayed episodes, the successes of both, the number of episodes that
end differently, the time of a control step in node, and the size of the page.
"""

from __future__ import annotations

import argparse
import gzip
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugins" / "frobs-view" / "tests"))

from page_episodes import compare, play

from frobs_train import open_pretrained
from frobs_view.page import write_page

IDS = ("Irb120Reach", "Ur5Reach", "PandaPush", "PandaPickAndPlace", "Ur5Lift")
REPLAYED = 10
MOST = 6
"""Most episodes of 200 that may end differently."""


def main() -> None:
    """Compare the pages of some IDs, and exit with 1 if too many episodes end differently."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ids", nargs="*", default=[f"frobs/{name}-v0" for name in IDS], help="environment IDs")
    parser.add_argument("--episodes", type=int, default=200)
    arguments = parser.parse_args()
    sys.stdout.write("| ID | deviation | Python | page | different | ms/step | MB |\n|---|---|---|---|---|---|---|\n")
    failed = False
    for id in arguments.ids:
        run = open_pretrained(id)
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder)
            write_page(run, page, starts=arguments.episodes)
            size = sum(len(gzip.compress(path.read_bytes(), 6)) for path in page.iterdir())
            episodes = play(run, arguments.episodes, REPLAYED)
            found = compare(page, episodes)
        python = sum(episode["success"] for episode in episodes)
        cells = (id, f"{found['positions']:.1e}", python, found["successes"], found["different"], f"{found['ms']:.2f}")
        sys.stdout.write(f"| {' | '.join(map(str, cells))} | {size / 1e6:.2f} |\n")
        sys.stdout.flush()
        failed |= found["different"] > MOST * arguments.episodes / 200
    sys.exit(failed)


if __name__ == "__main__":
    main()

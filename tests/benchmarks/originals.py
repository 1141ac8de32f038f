"""Measure how many steps per second the original packages of FRobs_RL take on the bridge, without changes.

Requires ROS 1 (``frobs doctor ros``), the packages in ``../shared/frobs_rl/originals``, an idle machine, and two
minutes::

    python tests/benchmarks/originals.py
    python tests/benchmarks/originals.py --backend bridge:gazebo --steps 200

Only calls of ``step`` of the original environment class are timed. Resets are excluded, and the packages sleep nowhere
else.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ORIGINALS = Path(__file__).parents[3] / "shared" / "frobs_rl" / "originals"
BUDGET = 150.0
"""Minimum number of steps per second."""
ENVIRONMENTS = {
    "KobukiMazeEnv": ("kobuki_maze/kobuki_maze_rl", "kobuki_maze_rl.task_env.kobuki_maze", {}),
    "ABBIRB140VelReacherEnv": (
        "abb_irb140_reacher/abb_irb140_reacher",
        "abb_irb140_reacher.task_env.abb_irb140_vel_reacher",
        {"custom_world_pkg": "abb_irb140_reacher", "custom_world_name": "no_collision.world"},
    ),
}
"""For each environment class: its package, its module, and the world that the package's own scripts launch."""

DRIVER = """
import json
from statistics import median
from time import perf_counter, process_time

import rospy
from frobs_rl.common import ros_gazebo
from {module} import {name}

ros_gazebo.launch_Gazebo(paused=True, gui=False, **{world})
rospy.init_node("measurement")
env = {name}()
env.action_space.seed(0)
env.reset()
seen, processor = [], 0.0
for k in range({steps} + 20):
    action = env.action_space.sample()
    start, before = perf_counter(), process_time()
    done = env.step(action)[2]
    if k >= 20:
        seen.append(perf_counter() - start)
        processor += process_time() - before
    if done:
        env.reset()
print("RESULT", json.dumps({{"rate": len(seen) / sum(seen), "median": median(seen), "processor": processor / len(seen)}}))
env.close()
"""


def measure(name: str, backend: str, steps: int) -> dict[str, Any]:
    """Step an original environment with random actions.

    Returns:
        ``rate`` of steps [1/s], ``median`` of the duration of a step [s], and ``processor`` time of a step in the
        client [s].
    """
    package, module, world = ENVIRONMENTS[name]
    with TemporaryDirectory() as folder, socket.socket() as probe:
        root = Path(folder, "catkin_ws", "src")
        shutil.copytree(ORIGINALS, root)
        script = root / "frobs_rl_resources" / package / "src" / "measure.py"
        script.parent.chmod(0o755)
        script.write_text(DRIVER.format(module=module, name=name, world=world, steps=steps), "utf-8")
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
        probe.close()
        done = subprocess.run(
            [sys.executable, "-m", "frobs_cli", "legacy", "run", str(script)],
            env={
                **os.environ,
                "ROS_PACKAGE_PATH": str(root),
                "ROS_MASTER_URI": f"http://localhost:{port}",
                "ROS_HOSTNAME": "localhost",
                "ROS_HOME": folder,
                "FROBS_ROS_BACKEND": backend,
            },
            capture_output=True,
            text=True,
            timeout=600,
        )
    found = re.search(r"^RESULT (.*)$", done.stdout, re.MULTILINE)
    if found is None:
        sys.exit(done.stderr[-3000:])
    result: dict[str, Any] = json.loads(found[1])
    return result


def main() -> None:
    """Measure each environment, and print one line for each."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--backend", default="bridge:mujoco", help="backend of the bridge")
    parser.add_argument("--steps", type=int, default=1000, help="number of timed steps")
    given = parser.parse_args()
    for name in ENVIRONMENTS:
        load, found = os.getloadavg()[0], measure(name, given.backend, given.steps)
        missed = "" if found["rate"] >= BUDGET else ": missed"
        sys.stdout.write(
            f"{name} on {given.backend}: {found['rate']:.0f} steps/s (≥ {BUDGET:g}{missed}); median step "
            f"{1e3 * found['median']:.1f} ms, of which {1e3 * found['processor']:.1f} ms in the client's processor time; "
            f"{load:.1f} other processes wanted a processor when it began\n"
        )


if __name__ == "__main__":
    main()

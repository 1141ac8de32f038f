"""Tasks are short: how many files and lines define one, and how many files change for a term of its reward."""

from __future__ import annotations

import inspect
import os
import shutil
import subprocess
import sys
from pathlib import Path

from frobs_tasks_manipulation.pick_and_place import PickAndPlace

ROOT = Path(__file__).parents[1]
SOURCE = Path("plugins/frobs-tasks-manipulation/src")

PATCH = """
--- a/plugins/frobs-tasks-manipulation/src/frobs_tasks_manipulation/pick_and_place.py
+++ b/plugins/frobs-tasks-manipulation/src/frobs_tasks_manipulation/pick_and_place.py
@@ -30,2 +30,5 @@
         approach=APPROACH,
+        slow=RewardTerm(
+            function=lambda task: task.speed, weight=-0.25, meaning="v, where v is the speed of the cube", unit="m/s"
+        ),
         grip=GRIP,
"""

CODE = """
import gymnasium as gym
env = gym.make("frobs_core:frobs/PandaPickAndPlace-v0").unwrapped
env.reset(seed=0)
*_, reward, _, _, info = env.step(env.action_space.sample())
task = env.task
terms = [value for key, value in info.items() if key.startswith("frobs/reward/")]
assert info["frobs/reward/slow"] == -0.25 * task.speed[0]
assert abs(reward - sum(terms)) < 1e-12
assert task.reward_meanings["slow"] == "−0.25 · v, where v is the speed of the cube [m/s]"
assert "``slow``: −0.25 · v" in type(task).__doc__
"""


def test_pick_and_place_is_two_files_of_at_most_250_lines() -> None:
    modules = [cls.__module__ for cls in PickAndPlace.__mro__ if cls.__module__.startswith("frobs_tasks_")]
    files = {Path(inspect.getfile(sys.modules[module])) for module in modules}
    assert {file.name for file in files} == {"manipulation.py", "pick_and_place.py"}
    assert max(len(file.read_text("utf-8").splitlines()) for file in files) <= 250


def test_a_term_of_a_reward_changes_one_file(tmp_path: Path) -> None:
    shutil.copytree(ROOT / SOURCE, tmp_path / SOURCE)
    applied = subprocess.run(
        ["git", "apply", "--recount", "-"], input=PATCH.lstrip(), text=True, cwd=tmp_path, capture_output=True
    )
    assert applied.returncode == 0, applied.stderr
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / SOURCE)}
    done = subprocess.run([sys.executable, "-c", CODE], env=environment, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr

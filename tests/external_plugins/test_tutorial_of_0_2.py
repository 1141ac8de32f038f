"""The plugin that the tutorial of version 0.2 built, with a task, a gripper and an expert, works unchanged."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

TUTORIAL = Path(__file__).parent / "lift_part_0.2"


def test_the_task_and_the_expert_of_the_tutorial_work_with_warnings(tmp_path):
    site = shutil.copytree(TUTORIAL, tmp_path / "site")
    info = site / "frobs_tasks_lift_part-0.1.0.dist-info"
    info.mkdir()
    requires = "Requires-Dist: frobs-core<0.3,>=0.2"
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: frobs-tasks-lift-part\nVersion: 0.1.0\n{requires}\n")
    (info / "entry_points.txt").write_text("[frobs]\nlift_part = frobs_tasks_lift_part.plugin\n")
    words = ["-m", "frobs_cli", "evaluate", "lab/LiftPart-v0", "--expert", "--episodes", "16", "--json"]
    environment = {**os.environ, "PYTHONPATH": str(site), "FROBS_DEPRECATIONS": ""}
    command = [sys.executable, "-W", "always::DeprecationWarning", *words]
    done = subprocess.run(command, env=environment, text=True, capture_output=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["success_rate"] == 1.0
    for name in ("_dense_terms", "tcp", "tool_terms", "draw_place", "draw_turn"):
        assert f"LiftPart.{name} has been deprecated since frobs-core 0.3" in done.stderr

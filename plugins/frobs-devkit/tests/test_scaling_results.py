from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from frobs_devkit.scaling import ScalingPoint, ScalingResult, plot_scaling
from frobs_devkit.scaling.processes import window_rates


def point(sweep: str, **sizes: Any) -> ScalingPoint:
    made = {"num_envs": 64, "threads": 1, "processes": 1, "nodes": 1, **sizes}
    speed = 5000.0 * made["processes"]
    facts = {"low": 0.9 * speed, "high": 1.1 * speed, "processor_share": 1.0, "memory": 10**8, "startup": 3.0}
    return ScalingPoint(sweep=sweep, steps_per_second=speed, **{"hosts": made["nodes"], **facts, **made})


def result(**changes: Any) -> ScalingResult:
    points = [point("num_envs", num_envs=size) for size in (1, 64)]
    points += [point("threads", threads=size) for size in (1, 2)]
    points += [point("processes", processes=size) for size in (1, 2, 4, 8)]
    points += [point("cluster", processes=8 * size, nodes=size) for size in (1, 2, 4)]
    facts: dict[str, Any] = {
        "id": "frobs/Irb120Reach-v0",
        "points": tuple(points),
        "num_envs": 64,
        "memory_per_process": 10**8,
        "memory_per_env": 4000,
        "machine": "a machine",
        "processors": 8,
        "load": 0.1,
    }
    return ScalingResult(**facts | changes)


def test_only_busy_processors_disturb_a_measurement() -> None:
    slowed = tuple(replace(point, processor_share=0.25) for point in result().points)
    assert result(points=slowed, load=20.0).is_disturbed
    assert not result(points=slowed, load=0.0).is_disturbed  # a simulator that waits
    assert slowed[0].undisturbed == 4.0 * slowed[0].steps_per_second


def test_results_survive_json() -> None:
    found = result()
    assert ScalingResult.from_dict({**json.loads(json.dumps(found.to_dict())), "date": "today"}) == found


def test_only_the_time_when_all_processes_step_counts() -> None:
    early = [(0.0, 0), (1.0, 100), (2.0, 200), (3.0, 300), (4.0, 400)]
    late = [(2.0, 0), (3.0, 10), (4.0, 20), (5.0, 1000)]
    assert window_rates([early, late], windows=2) == pytest.approx([110.0, 110.0])
    assert window_rates([[(0.0, 0), (10.0, 5)]]) == pytest.approx([0.5])  # one slow step: no more windows than steps


@pytest.mark.parametrize("sweeps", [("num_envs", "threads", "processes", "cluster"), ("num_envs",)])
def test_a_plot_is_drawn(sweeps: tuple[str, ...], tmp_path: Path) -> None:
    found = result()
    found = replace(found, points=tuple(point for point in found.points if point.sweep in sweeps))
    path = plot_scaling([found] * 2, tmp_path / "scaling.png")
    assert path.read_bytes().startswith(b"\x89PNG")

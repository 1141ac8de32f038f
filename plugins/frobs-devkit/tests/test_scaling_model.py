from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from frobs_core.util.errors import ConfigurationError
from frobs_devkit.scaling import LearnerCosts, ScalingPoint, ScalingResult, Traffic, fit_model, plot_scaling
from frobs_devkit.scaling.model import fit_contention
from frobs_devkit.scaling.processes import window_rates

SPEED, CONTENTION, BETWEEN = 5000.0, 0.02, 0.004
LEARNER = LearnerCosts(algorithm="ppo", inference=1e-5, learning=2e-5, total=2.3e-4, processor_share=1.0)


def rate(nodes: int, processes: int) -> float:
    return nodes * processes * SPEED / ((1.0 + CONTENTION * (processes - 1)) * (1.0 + BETWEEN * (nodes - 1)))


def point(sweep: str, **sizes: Any) -> ScalingPoint:
    made = {"num_envs": 64, "threads": 1, "processes": 1, "nodes": 1, **sizes}
    speed = rate(made["nodes"], made["processes"] // made["nodes"])
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
        "traffic": Traffic(bytes_per_step=100.0, bytes_per_second=1e9, hosts=("a", "b")),
        "learner": LEARNER,
        "machine": "a machine",
        "processors": 8,
        "load": 0.1,
    }
    return ScalingResult(**facts | changes)


def without(found: ScalingResult, sweep: str) -> ScalingResult:
    return replace(found, points=tuple(point for point in found.points if point.sweep != sweep))


def test_the_parameters_of_synthetic_data_are_recovered() -> None:
    model = fit_model(result())
    assert model.process_rate == pytest.approx(SPEED)
    assert model.process_contention == pytest.approx(CONTENTION)
    assert model.node_contention == pytest.approx(BETWEEN)
    assert model.node_contention_measured
    assert model.collected(100, 8) == pytest.approx(rate(100, 8))
    assert (model.process_error, model.cluster_error) == (pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-9))


def test_noise_changes_the_parameters_little() -> None:
    noisy = [(size, rate(1, size) * (1.0 + noise)) for size, noise in ((1, 0.01), (2, -0.01), (4, 0.01), (8, -0.005))]
    speed, contention = fit_contention(noisy)
    assert speed == pytest.approx(SPEED, rel=0.02)
    assert contention == pytest.approx(CONTENTION, abs=0.01)


def test_speed_beyond_linear_counts_as_no_contention() -> None:
    assert fit_contention([(1, 100.0), (2, 220.0)]) == (pytest.approx(105.0), 0.0)
    assert fit_contention([(4, 400.0)]) == (pytest.approx(100.0), 0.0)


def test_the_error_is_that_of_the_size_that_was_left_out() -> None:
    points = [point("num_envs"), point("processes"), replace(point("processes", processes=2), steps_per_second=8000.0)]
    model = fit_model(result(points=tuple(points)))
    assert model.process_error == pytest.approx(10_000.0 / 8000.0 - 1.0)
    assert model.cluster_error is None


def test_nodes_on_one_machine_say_nothing_about_the_contention_between_nodes() -> None:
    found = result()
    model = fit_model(replace(found, points=tuple(replace(point, hosts=1) for point in found.points)))
    assert (model.node_contention, model.node_contention_measured) == (0.0, False)
    assert model.cluster_error is not None


@pytest.mark.parametrize(
    ("nodes", "bandwidth", "learning", "limit", "speed"),
    [
        pytest.param(1, None, 2e-6, "collection", rate(1, 8) / (1.0 + SPEED * 1e-5), id="collection"),
        pytest.param(100, None, 2e-5, "learner", 50_000.0, id="learner"),
        pytest.param(100, 1e6, 2e-5, "network", 10_000.0, id="network"),
    ],
)
def test_one_training_run_is_as_fast_as_its_slowest_part(
    nodes: int, bandwidth: float | None, learning: float, limit: str, speed: float
) -> None:
    model = fit_model(result(learner=replace(LEARNER, learning=learning)), bandwidth=bandwidth)
    predicted = model.predict(nodes, 8, 1_000_000, price=2.0)
    assert predicted.limit == limit
    assert predicted.steps_per_second == pytest.approx(speed)
    assert predicted.seconds == pytest.approx(3.0 + 1e6 / speed)
    assert predicted.node_hours == pytest.approx(nodes * (3.0 + 1e6 / speed) / 3600.0)
    assert predicted.cost == pytest.approx(2.0 * nodes * (3.0 + 1e6 / speed) / 3600.0)


def test_independent_runs_have_no_common_learner() -> None:
    model = fit_model(without(result(), "cluster"))
    few, many = (model.predict(count, 8, 1_000_000).runs_per_hour for count in (1, 1000))
    assert few is not None
    assert many == pytest.approx(1000 * few)


def test_without_a_price_there_is_no_cost_and_without_a_training_run_no_time() -> None:
    assert fit_model(result()).predict(10, 8, 1000).cost is None
    predicted = fit_model(result(learner=None)).predict(10, 8, 1000)
    assert predicted.collected > 0.0
    assert (predicted.steps_per_second, predicted.seconds, predicted.runs_per_hour) == (None, None, None)


def test_a_busy_machine_is_corrected_for() -> None:
    found = result(load=20.0)
    slowed = [
        replace(point, processor_share=0.25, steps_per_second=0.25 * point.steps_per_second) for point in found.points
    ]
    model = fit_model(replace(found, points=tuple(slowed), learner=replace(LEARNER, processor_share=0.5)))
    assert model.corrected
    assert model.process_rate == pytest.approx(SPEED)
    assert model.learner is not None
    assert model.learner.learning == pytest.approx(0.5 * LEARNER.learning)
    assert not fit_model(replace(found, points=tuple(slowed), load=0.0)).corrected  # a simulator that waits


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, 8, 1000), "nodes is 0; it must be a whole number of at least 1"),
        ((1, 8, 0), "steps is 0"),
        ((1, 8, 1000, -1.0), "price"),
    ],
)
def test_a_prediction_rejects_bad_numbers(arguments: Any, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        fit_model(result()).predict(*arguments)


def test_a_bandwidth_is_positive() -> None:
    with pytest.raises(ConfigurationError, match="bandwidth"):
        fit_model(result(), bandwidth=-1.0)


def test_results_survive_json() -> None:
    import json

    found = result()
    assert ScalingResult.from_dict({**json.loads(json.dumps(found.to_dict())), "model": {}}) == found


def test_only_the_time_when_all_processes_step_counts() -> None:
    early = [(0.0, 0), (1.0, 100), (2.0, 200), (3.0, 300), (4.0, 400)]
    late = [(2.0, 0), (3.0, 10), (4.0, 20), (5.0, 1000)]
    assert window_rates([early, late], windows=2) == pytest.approx([110.0, 110.0])
    assert window_rates([[(0.0, 0), (10.0, 5)]]) == pytest.approx([0.5])  # one slow step: no more windows than steps


def test_a_plot_is_drawn(tmp_path: Any) -> None:
    found = result()
    path = plot_scaling([(found, fit_model(found), 8)] * 2, tmp_path / "scaling.png")
    assert path.read_bytes().startswith(b"\x89PNG")

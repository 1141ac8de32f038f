from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from frobs_core.util.errors import RunError
from frobs_core.util.files import write_json
from frobs_train import COLORS, Run, RunConfig, plot_runs
from frobs_train.logs.progress import STEPS, ProgressLog, read_columns, smooth
from frobs_train.plots.figures import colors_of, make_figure
from frobs_train.plots.plot import _Curves, _mark_evaluation


def size(path: Path) -> tuple[int, int]:
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG")
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def make(path: Path, seed: int, rows: int = 10, success: bool = True, **config: object) -> Run:
    run = Run.create(path, RunConfig(environment="X-v0", seed=seed, **config))  # type: ignore[arg-type]
    with ProgressLog(path) as log:
        for row in range(rows):
            log.write(
                {
                    STEPS: 100 * (row + 1),
                    "episode/count": 2,
                    "episode/reward": float(row + seed),
                    "episode/success": 0.1 * row if success else None,
                    "reward/distance": -1.0 if success else None,
                }
            )
    return run


def test_success_reward_and_terms_stand_side_by_side(trained: Run, tmp_path: Path) -> None:
    width, height = size(plot_runs([trained], tmp_path / "plots" / "curve.png"))
    assert width > 3 * height


def test_a_plot_of_one_run_goes_into_its_folder(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0)
    assert plot_runs([run]) == run.path / "plots" / "learning_curve.png"


def test_seeds_are_drawn_as_a_band_and_others_beside_it(tmp_path: Path) -> None:
    runs = [make(tmp_path / str(seed), seed, rows=5 + seed) for seed in range(3)]
    runs += [make(tmp_path / "other", 0, num_envs=3)]
    assert plot_runs(runs) == tmp_path / "learning_curves.png"


def test_a_run_without_success_is_drawn_without(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0, success=False)
    plot_runs([run], tmp_path / "a.png")


def test_only_an_evaluation_as_trained_is_marked(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0)
    found = {"steps": 1000, "episodes": 10, "success_rate": 0.5, "success_interval": [0.2, 0.8], "mean_reward": 1.0}
    for name, changes in (
        ("as_trained", {}),
        ("elsewhere", {"simulator": "pybullet"}),
        ("randomized", {"randomize": {"masses": {}}}),
        ("sampled", {"deterministic": False}),
    ):
        other = {"success_rate": 0.4, "episodes": 20} if changes else {}
        write_json(run.path / "evaluations" / f"{name}.json", {**found, **other, **changes})
    axis = make_figure(4.0, 3.0).subplots()
    _mark_evaluation(axis, _Curves(run, read_columns(run.path), "steps"), COLORS[0], annotate=True)
    assert [text.get_text() for text in axis.texts] == ["50.0 % of 10\nnew episodes"]


def test_an_algorithm_has_one_color_in_every_picture() -> None:
    alone = colors_of({"SAC": "sac"})
    beside = colors_of({"PPO": "ppo", "SAC": "sac", "SAC 2": "sac", "own": "my_own_algorithm"})
    assert alone["SAC"] == beside["SAC"]
    assert len(set(beside.values())) == 4
    assert colors_of({"mine": "my_own_algorithm"})["mine"] in (beside["own"], *COLORS)


def test_a_run_without_rows_is_named(tmp_path: Path) -> None:
    run = make(tmp_path / "a", 0, rows=0)
    with pytest.raises(RunError, match=r"progress\.csv has no rows yet"):
        plot_runs([run])
    with pytest.raises(RunError, match="pass at least one"):
        plot_runs([])


def test_smoothing_weighs_and_leaves_out_what_is_missing() -> None:
    values, weights = np.array([0.0, 1.0, np.nan, 3.0]), np.array([1.0, 3.0, 5.0, 1.0])
    np.testing.assert_allclose(smooth(values, weights, window=0.5), [0.75, 0.75, 1.5, 3.0])
    np.testing.assert_array_equal(smooth(values, weights, window=0.01), values)

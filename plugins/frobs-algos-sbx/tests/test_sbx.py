"""The algorithms in JAX: exact continuation, equal ONNX graphs, and settings that sbx lacks."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import test_sb3_exact as exact

from frobs_algos import storage
from frobs_core import plugins
from frobs_core.util.errors import CheckpointError, ConfigurationError, PluginError
from frobs_train import resolve_config

SMALL = {"policy_kwargs": {"net_arch": [8, 8]}}
NORMAL_PPO = {**exact.EPOCHS, **exact.NORMAL, "clip_range": "lin_0.2", "clip_range_vf": 0.2, "target_kl": 1e-4}

CASES = {
    "ppo": ("sbx_ppo", exact.REACH, {**exact.EPOCHS, "batch_size": 12}),
    "ppo-goal-normalized": ("sbx_ppo", exact.GOAL, NORMAL_PPO),
    "sac-hindsight": ("sbx_sac", exact.GOAL, exact.HINDSIGHT),
    "sac-normalized": ("sbx_sac", exact.REACH, {**exact.REPLAY, **exact.NORMAL, **exact.WANDERING}),
    "td3-n_steps": ("sbx_td3", exact.REACH, {**exact.REPLAY, "action_noise": {"sigma": 0.2}, "n_steps": 3}),
    "td3-hindsight-normalized": ("sbx_td3", exact.GOAL, {**exact.HINDSIGHT, "normalize_observation": True}),
    "tqc-elu": ("sbx_tqc", exact.REACH, {**exact.REPLAY, "policy_kwargs": {"net_arch": [8], "activation_fn": "elu"}}),
    "crossq-warm": (
        "sbx_crossq",
        exact.REACH,
        {**exact.REPLAY, "policy_kwargs": {"net_arch": [8], "renorm_warmup_steps": 3}},
    ),
    "dqn-discrete": ("sbx_dqn", exact.REACH, {**exact.REPLAY, **SMALL, "target_update_interval": 40}),
}
ALL = [pytest.param(*case, id=name, marks=pytest.mark.slow if "-" in name else ()) for name, case in CASES.items()]


@pytest.mark.parametrize(("name", "environment", "config"), ALL)
def test_continuing_changes_no_bit(
    name: str, environment: str, config: dict[str, Any], make: Any, monitor: Any, tmp_path: Path
) -> None:
    exact.test_continuing_changes_no_bit(name, environment, config, make, monitor, tmp_path)
    policy = plugins.get_record("algorithm", name).load().load(tmp_path / "first")
    assert_graph_acts_alike(policy, make(environment, 200, seed=9, **(exact.DISCRETE if name == "sbx_dqn" else {})))


@pytest.mark.slow
@pytest.mark.parametrize("case", ["sac-normalized", "ppo", "td3-n_steps"])
@pytest.mark.parametrize(
    "test",
    [
        exact.test_a_training_that_was_stopped_goes_on_with_no_bit_changed,
        exact.test_what_was_loaded_and_saved_at_once_continues_too,
        exact.test_what_was_saved_after_a_training_or_before_it_continues_too,
    ],
    ids=lambda test: test.__name__.removeprefix("test_"),
)
def test_other_continuations_change_no_bit(
    test: Any, case: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exact, "CASES", CASES)
    names = [name for name in inspect.signature(test).parameters if name != "case"]
    test(case=case, **{name: request.getfixturevalue(name) for name in names})


@pytest.mark.parametrize("name", ["sbx_td3", pytest.param("sbx_crossq", marks=pytest.mark.slow)])
def test_the_learning_rate_follows_its_schedule(name: str, make: Any, monitor: Any) -> None:
    algorithm = plugins.get_record("algorithm", name).load()(
        make(exact.REACH, 2), {**exact.REPLAY, "learning_rate": "lin_1e-3"}, 3
    )
    algorithm.train(120, monitor)
    rates = [metrics[f"{name}/learning_rate"] for _, metrics in monitor.rows if f"{name}/learning_rate" in metrics]
    assert rates == sorted(rates, reverse=True)
    assert rates[-1] < 2e-4 < rates[0]
    assert algorithm.model.policy.actor_state.opt_state.hyperparams["learning_rate"] == pytest.approx(rates[-1])


def assert_graph_acts_alike(policy: Any, env: Any) -> None:
    import onnxruntime as runtime

    session = runtime.InferenceSession(policy.export_onnx())
    for _ in range(5):
        observation = env.step(env.action_space.sample())[0]
        given = observation if isinstance(observation, dict) else {"": observation}
        feed = {"/".join(filter(None, ("observation", key))): value for key, value in given.items()}
        expected, _ = policy.predict(observation)
        np.testing.assert_allclose(session.run(["action"], feed)[0], expected, rtol=0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "config", "says"),
    [
        (
            "sbx_sac",
            {"use_sde": True},
            "use_sde must keep its default False, because sbx does not support this setting",
        ),
        ("sbx_ppo", {"policy_kwargs": {"full_std": False}}, "policy_kwargs.full_std must keep its default True"),
        ("sbx_dqn", {"policy_kwargs": {"net_arch": [64, 32]}}, "two equal widths"),
        ("sbx_tqc", {"policy_kwargs": {"n_critics": 3}}, "n_critics must be 2"),
        ("sbx_sac", {"device": "cuda"}, "device must keep its default 'cpu'"),
    ],
)
def test_a_setting_that_sbx_lacks_is_rejected(name: str, config: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        plugins.get_record("algorithm", name).load().resolve_config(config)


def test_an_update_ends_early_at_the_divergence_that_is_allowed(make: Any, monitor: Any) -> None:
    cls = plugins.get_record("algorithm", "sbx_ppo").load()
    config = {**exact.EPOCHS, "n_epochs": 20, "learning_rate": 0.01}
    largest = []
    for target in (None, 0.01):
        algorithm = cls(make(exact.REACH, 2), {**config, "target_kl": target}, 3)
        algorithm.train(64, monitor)
        largest.append(max(metrics["sbx_ppo/approx_kl"] for _, metrics in monitor.rows))
        monitor.rows = []
    assert largest[1] < 0.02 < largest[0]


def test_weights_of_another_network_are_rejected(make: Any, tmp_path: Path) -> None:
    cls = plugins.get_record("algorithm", "sbx_ppo").load()
    cls(make(exact.REACH, 2), exact.EPOCHS, 3).save_policy(tmp_path)
    arrays = storage.read_arrays(tmp_path / "policy.npz")
    kernel = next(name for name in arrays if name.endswith("kernel"))
    storage.write_arrays(tmp_path / "policy.npz", {**arrays, kernel: arrays[kernel][1:]})
    with pytest.raises(CheckpointError, match="does not match the settings"):
        cls.load(tmp_path)


@pytest.mark.parametrize("name", ["ppo", "sac", "td3", "tqc", "crossq", "dqn"])
def test_settings_and_their_defaults_are_those_of_the_torch_family(name: str) -> None:
    resolved = (plugins.get_record("algorithm", prefix + name).load().resolve_config({}) for prefix in ("sbx_", ""))
    ours, theirs = (settings.model_dump() for settings in resolved)
    assert {key: ours[key] for key in theirs} == theirs
    assert set(ours) - set(theirs) <= {"policy_delay"}


@pytest.mark.parametrize("name", ["ppo", "sac", "td3", "dqn"])
def test_tuned_settings_and_search_spaces_are_those_of_the_torch_family(name: str) -> None:
    ours, theirs = (plugins.get_record("algorithm", prefix + name) for prefix in ("sbx_", ""))
    assert (ours.tuned, ours.search_space) == (theirs.tuned, theirs.search_space)
    for environment in ours.tuned:
        assert resolve_config(environment, flags={"algorithm": ours.name}).algorithm == ours.name


@pytest.mark.parametrize("name", ["sbx_ppo", "sbx_sac"])
def test_without_jax_one_error_says_how_to_install_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    record = plugins.get_record("algorithm", name)
    for module in [module for module in sys.modules if module.partition(".")[0] == "frobs_algos_sbx"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(PluginError, match=r"jax.*pip install -e .*plugins/frobs-algos-sbx") as caught:
        record.load()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["sbx_sac", "sbx_td3", "sbx_tqc", "sbx_crossq", "sbx_dqn"])
def test_first_weights_are_as_wide_as_those_of_the_torch_family(name: str, make: Any) -> None:
    from frobs_algos_sbx import state

    env = make(exact.REACH, 2, **(exact.DISCRETE if name == "sbx_dqn" else {}))
    record = plugins.get_record("algorithm", name).load()
    algorithms = [record(env, record.resolve_config({}), seed) for seed in (1, 1, 2)]
    first, again, other = (state.networks(algorithm.model) for algorithm in algorithms)
    kernels = [key for key in first if key.endswith("/kernel") and "/params/" in key]
    assert kernels
    for key in kernels:
        bound = first[key].shape[-2] ** -0.5
        for array in (first[key], first[key.replace("/kernel", "/bias")]):
            assert 0.5 * bound < np.abs(array).max() <= bound
        assert np.array_equal(first[key], again[key])
        assert not np.array_equal(first[key], other[key])
        target = key.replace("/params/", "/target_params/", 1)
        assert np.array_equal(first.get(target, first[key]), first[key])

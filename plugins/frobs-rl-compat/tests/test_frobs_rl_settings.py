from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from frobs_core.util.errors import ConfigFileError, ConfigurationError
from frobs_core.util.yaml import load_yaml, load_yaml_text
from frobs_rl_compat.training import parameters
from frobs_rl_compat.training.config_files import DEFAULTS, find_config
from frobs_rl_compat.training.settings import CONFIGS, read_settings

TEMPLATES = Path(__file__).parents[3] / "templates" / "frobs_rl"

# The reacher's file in FRobs_RL's documentation, in its numbers and keys.
REACHER = """
model_params:
    training_steps: 100000          # The number of training steps to perform
    save_freq: 5000
    save_prefix: td3_model
    trained_model_name: trained_model
    save_replay_buffer: False
    load_model: False
    model_name: trained_model_01_09_2021_10_11_11
    log_folder: TD3_New
    log_interval: 1
    reset_num_timesteps: False
    use_custom_policy: False
    policy_params:
        net_arch: [400, 300]
        activation_fn: ReLU
        features_extractor_class: FlattenExtractor
        optimizer_class: Adam
    use_action_noise: True
    action_noise:
        mean: 0.0
        sigma: 0.01
    td3_params:
        learning_rate: 0.001
        buffer_size: 2e6
        learning_starts: 25000
        batch_size: 15000
        tau: 0.005
        gamma: 0.99
        gradient_steps: -1
        policy_delay: 2
        target_policy_noise: 0.2
        target_noise_clip: 0.5
        train_freq:
            freq: 1
            unit: episode
"""

EXPECTED = {
    "ppo": {"learning_rate": 3e-4, "n_steps": 100, "batch_size": 100, "n_epochs": 5, "gae_lambda": 0.95, "clip_range": 0.2},
    "a2c": {"learning_rate": 7e-4, "n_steps": 5, "gae_lambda": 1.0, "use_rms_prop": True, "rms_prop_eps": 1e-5},
    "ddpg": {"learning_rate": 1e-3, "buffer_size": 10**6, "batch_size": 100, "gradient_steps": -1, "train_freq": (20, "step")},
    "td3": {"learning_rate": 1e-3, "learning_starts": 100, "policy_delay": 2, "target_noise_clip": 0.5, "tau": 0.005},
    "sac": {"learning_rate": 3e-4, "batch_size": 256, "gradient_steps": 1, "ent_coef": "auto", "target_entropy": "auto"},
    "dqn": {"learning_rate": 1e-4, "learning_starts": 50_000, "batch_size": 32, "tau": 1.0, "max_grad_norm": 10.0},
}  # fmt: skip


@pytest.mark.parametrize("algorithm", CONFIGS)
def test_a_default_file_says_what_is_the_default_of_each_key(algorithm: str) -> None:
    path = DEFAULTS / f"{algorithm}_config.yaml"
    written = read_settings(load_yaml(path), algorithm, path)
    empty = read_settings({"model_params": {f"{algorithm}_params": {}}}, algorithm)
    assert written == empty
    assert EXPECTED[algorithm].items() <= written.model_kwargs().items()
    params = load_yaml(path)["model_params"]
    assert set(params[f"{algorithm}_params"]) <= set(CONFIGS[algorithm].model_fields)
    assert (params["training_steps"], params["save_freq"], params["log_interval"]) == (5000, 1000, 4)
    assert (params["log_folder"], params["model_name"]) == (f"{algorithm.upper()}_1", f"{algorithm}_model_5000_steps")


@pytest.mark.parametrize("algorithm", CONFIGS)
def test_the_template_is_the_default_file(algorithm: str) -> None:
    name = f"{algorithm}_config.yaml"
    assert (TEMPLATES / name).read_bytes() == (DEFAULTS / name).read_bytes()


def test_a_file_of_the_examples_loads_unchanged() -> None:
    found = read_settings(load_yaml_text(REACHER), "td3")
    assert found.unused == ()
    assert found.params.training_steps == 100_000
    assert found.params.policy_params.activation_fn == "relu"
    assert found.model_kwargs()["train_freq"] == (1, "episode")
    assert found.model_kwargs()["buffer_size"] == 2_000_000


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("training_steps:", "training_step:", r"f\.yaml:3: 'model_params' has no parameter 'training_step'. Did you mean 'training_steps'"),
        ("policy_delay:", "policy_dely:", r"f\.yaml:31: 'td3_params' has no parameter 'policy_dely'. Did you mean 'policy_delay'"),
        ("sigma:", "sigm:", r"f\.yaml:22: 'action_noise' of 'model_params' has no parameter 'sigm'. Did you mean 'sigma'"),
        ("activation_fn: ReLU", "activation_fn: step", r"f\.yaml:16: .*activation_fn is 'step'.*'relu', 'tanh', 'elu' or 'selu'"),
        ("unit: episode", "unit: hour", r"f\.yaml:36: .*'step' or 'episode'"),
        ("tau: 0.005", "tau: 5", r"f\.yaml:28: .*tau is 5; .*less than or equal to 1"),
        ("model_params:", "model_parms:", r"f\.yaml: a mapping is required under the root key 'model_params' instead of 'model_parms'"),
        ("td3_params:", "td3_parms:", r"f\.yaml: has no mapping 'td3_params' .*'td3_parms' may be a misspelling"),
        ("td3_params:", "sac_params:", r"f\.yaml: has no mapping 'td3_params' .*it has sac_params"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_file_line_and_the_nearest_key(old: str, new: str, message: str) -> None:
    with pytest.raises(ConfigFileError, match=message):
        read_settings(load_yaml_text(REACHER.replace(old, new), "f.yaml"), "td3", "f.yaml")


def test_keys_that_mean_nothing_to_the_algorithm_are_told() -> None:
    text = REACHER.replace("td3_params:", "dqn_params: {}\n    td3_params:")
    found = read_settings(load_yaml_text(text), "dqn")
    assert set(found.unused) == {"use_action_noise", "action_noise", "td3_params"}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """Makes a Python package that cannot be imported, for it wants ROS; its files can be found all the same."""
    monkeypatch.syspath_prepend(tmp_path)

    def make(file: str) -> Path:
        path = tmp_path / "arm_rl" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "arm_rl" / "__init__.py").write_text("import rospy_that_nobody_has")
        path.write_text(REACHER)
        return path

    return make


@pytest.mark.parametrize("file", ["config/td3.yaml", "td3.yaml"])
def test_a_python_package_s_file_is_found_in_its_config_folder_or_its_root(file: str, package: Any) -> None:
    path = package(file)
    assert find_config("arm_rl", "td3.yaml") == path


def test_frobs_rl_s_own_files_are_here() -> None:
    assert find_config("frobs_rl", "td3_config.yaml").read_bytes() == (DEFAULTS / "td3_config.yaml").read_bytes()


def test_a_path_needs_no_package(package: Any) -> None:
    path = package("td3.yaml")
    assert find_config(None, path) == find_config("frobs_rl", path) == path


@pytest.mark.parametrize(
    ("name", "file", "message"),
    [
        ("arm_rl", "td4.yaml", r"Did you mean 'td3.yaml'\?"),
        ("nobody_s_package", "td3.yaml", "no Python package or ROS package named 'nobody_s_package'"),
        ("frobs_rl", "tb3_config.yaml", r"Did you mean 'td3_config.yaml'\?"),
        (None, "nowhere/td3.yaml", "does not exist"),
    ],
)
def test_a_file_that_is_missing_is_named(name: str | None, file: str, message: str, package: Any) -> None:
    package("config/td3.yaml")
    with pytest.raises(ConfigurationError, match=message):
        find_config(name, file)


class FakeRospack:
    """Stands in for rospkg, which only ROS brings."""

    class ResourceNotFound(Exception):  # noqa: N818  # its name in rospkg
        pass

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def RosPack(self) -> FakeRospack:  # noqa: N802  # its name in rospkg
        return self

    def get_path(self, package: str) -> str:
        if package != "arm_rl":
            raise self.ResourceNotFound
        return str(self._folder)


def test_where_ros_is_a_ros_package_s_config_folder_comes_first(
    package: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package("td3.yaml")
    (tmp_path / "ros" / "config").mkdir(parents=True)
    (tmp_path / "ros" / "config" / "td3.yaml").write_text(REACHER)
    monkeypatch.setitem(sys.modules, "rospkg", FakeRospack(tmp_path / "ros"))  # type: ignore[arg-type]
    assert find_config("arm_rl", "td3.yaml") == tmp_path / "ros" / "config" / "td3.yaml"
    assert find_config("frobs_rl", "td3_config.yaml").read_bytes() == (DEFAULTS / "td3_config.yaml").read_bytes()


class FakeRospy:
    """Stands in for rospy with a master, which only ROS brings."""

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}

    def set_param(self, name: str, value: Any) -> None:
        self.values[name] = value

    def has_param(self, name: str) -> bool:
        return name in self.values

    def get_param(self, name: str) -> Any:
        return self.values[name]


@pytest.mark.parametrize(("ns", "name"), [("/", "/model_params"), ("/robot1", "/robot1/model_params")])
def test_parameters_go_through_the_parameter_server_where_one_runs(
    ns: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = FakeRospy()
    monkeypatch.setattr(parameters, "parameter_server", lambda: server)
    (tmp_path / "td3.yaml").write_text(REACHER)
    mapping = parameters.load_parameters(tmp_path / "td3.yaml", ns)
    assert type(server.values[name]) is dict
    assert parameters.current_parameters(mapping, ns) is mapping
    server.values[name]["training_steps"] = 7
    assert parameters.current_parameters(mapping, ns)["model_params"]["training_steps"] == 7
    del server.values[name]
    with pytest.raises(ConfigFileError, match="the parameters were deleted"):
        parameters.current_parameters(mapping, ns)


def test_without_ros_there_is_no_parameter_server() -> None:
    assert parameters.parameter_server() is None

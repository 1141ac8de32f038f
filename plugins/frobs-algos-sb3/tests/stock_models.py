"""Models as stable-baselines3 itself writes them, small."""

from __future__ import annotations

import base64
import io
import json
import pickle
import sys
import types
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import stable_baselines3 as sb3
import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.envs import FakeImageEnv
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.utils import LinearSchedule

th.set_num_threads(1)

SMALL = {"buffer_size": 50}
NOISE = NormalActionNoise(np.zeros(1), 0.1 * np.ones(1))


class Pictures(gym.Env[Any, Any]):
    """A dictionary of a picture and a vector; the bounds of the actions are none that eight decimals can hold."""

    observation_space = gym.spaces.Dict(
        {"camera": gym.spaces.Box(0, 255, (36, 36, 3), np.uint8), "joints": gym.spaces.Box(-1.0, 1.0, (4,), np.float32)}
    )
    action_space = gym.spaces.Box(-np.float32(np.pi) * np.ones(2, np.float32), np.array([0.1, 1 / 3], np.float32))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return self.observation_space.sample(), 0.0, False, False, {}


class FlatDictionary(Pictures):
    """Two vectors, whose keys are not in the order of the alphabet."""

    observation_space = gym.spaces.Dict(
        [("v", gym.spaces.Box(-np.inf, np.inf, (2,))), ("a", gym.spaces.Box(np.array([-1.5, 0.0]), np.array([2.0, 1.0]), dtype=float))]
    )  # fmt: skip


def image() -> FakeImageEnv:
    return FakeImageEnv(screen_height=36, screen_width=36, n_channels=3)


def layers(
    activation: type[th.nn.Module], optimizer: type[th.optim.Optimizer] = th.optim.Adam, **arch: Any
) -> dict[str, Any]:
    return {"net_arch": arch or [7, 5], "activation_fn": activation, "optimizer_class": optimizer}


MODELS: dict[str, Callable[[], BaseAlgorithm]] = {
    "ppo": lambda: sb3.PPO("MlpPolicy", "Pendulum-v1", n_steps=64),
    "ppo-layers": lambda: sb3.PPO(
        "MlpPolicy", "Pendulum-v1", n_steps=64, learning_rate=LinearSchedule(1e-3, 0.0, 1.0),
        policy_kwargs=layers(th.nn.ELU, th.optim.RMSprop, pi=[7], vf=[5, 3]) | {"log_std_init": -1.0},
    ),
    "ppo-sde": lambda: sb3.PPO("MlpPolicy", "Pendulum-v1", n_steps=64, use_sde=True, sde_sample_freq=4),
    "ppo-discrete": lambda: sb3.PPO("MlpPolicy", "CartPole-v1", n_steps=64),
    "ppo-image": lambda: sb3.PPO("CnnPolicy", image(), n_steps=64, policy_kwargs={"features_extractor_kwargs": {"features_dim": 9}}),
    "ppo-dictionary": lambda: sb3.PPO("MultiInputPolicy", FlatDictionary(), n_steps=64),
    "a2c": lambda: sb3.A2C("MlpPolicy", "Pendulum-v1"),
    "a2c-rates": lambda: sb3.A2C("MlpPolicy", "Pendulum-v1", use_rms_prop=False, policy_kwargs=layers(th.nn.SELU, th.optim.SGD)),
    "a2c-pictures": lambda: sb3.A2C("MultiInputPolicy", Pictures(), policy_kwargs={"features_extractor_kwargs": {"cnn_output_dim": 6}}),
    "ddpg": lambda: sb3.DDPG("MlpPolicy", "Pendulum-v1", action_noise=NOISE, **SMALL),
    "ddpg-layers": lambda: sb3.DDPG("MlpPolicy", "Pendulum-v1", policy_kwargs=layers(th.nn.Tanh), **SMALL),
    "dqn": lambda: sb3.DQN("MlpPolicy", "CartPole-v1", **SMALL),
    "dqn-layers": lambda: sb3.DQN("MlpPolicy", "CartPole-v1", policy_kwargs=layers(th.nn.SELU, th.optim.Adagrad), **SMALL),
    "dqn-image": lambda: sb3.DQN("CnnPolicy", image(), policy_kwargs={"features_extractor_kwargs": {"features_dim": 9}}, **SMALL),
    "sac": lambda: sb3.SAC("MlpPolicy", "Pendulum-v1", **SMALL),
    "sac-sde": lambda: sb3.SAC("MlpPolicy", "Pendulum-v1", use_sde=True, ent_coef="auto_0.2", policy_kwargs=layers(th.nn.ELU, pi=[7], qf=[5]), **SMALL),
    "sac-dictionary": lambda: sb3.SAC("MultiInputPolicy", FlatDictionary(), ent_coef=0.1, **SMALL),
    "td3": lambda: sb3.TD3("MlpPolicy", "Pendulum-v1", action_noise=NOISE, **SMALL),
    "td3-layers": lambda: sb3.TD3("MlpPolicy", "Pendulum-v1", policy_kwargs=layers(th.nn.ELU, th.optim.Adadelta) | {"n_critics": 3}, **SMALL),
    "td3-pictures": lambda: sb3.TD3("MultiInputPolicy", Pictures(), policy_kwargs={"net_arch": [8]}, **SMALL),
}  # fmt: skip

try:
    import sb3_contrib
except ImportError:
    pass
else:
    MODELS |= {
        "tqc": lambda: sb3_contrib.TQC("MlpPolicy", "Pendulum-v1", **SMALL),
        "tqc-layers": lambda: sb3_contrib.TQC(
            "MlpPolicy", "Pendulum-v1", policy_kwargs=layers(th.nn.ELU) | {"n_quantiles": 7, "n_critics": 1}, **SMALL
        ),
        "crossq": lambda: sb3_contrib.CrossQ("MlpPolicy", "Pendulum-v1", policy_kwargs={"net_arch": [8]}, **SMALL),
        "recurrent_ppo": lambda: sb3_contrib.RecurrentPPO(
            "MlpLstmPolicy", "Pendulum-v1", n_steps=64, policy_kwargs={"lstm_hidden_size": 6, "n_lstm_layers": 2}
        ),
    }


def spaces_of(path: Path) -> tuple[gym.Space[Any], gym.Space[Any]]:
    """Return the spaces of the environment in which a stock model was made, from the model's pickles."""
    data = read_data(path)
    observation, action = (
        pickle.loads(base64.b64decode(data[key][":serialized:"])) for key in ("observation_space", "action_space")
    )
    return observation, action


def write(name: str, folder: Path) -> Path:
    """Write a stock model; it is as good as trained, for its weights are random."""
    th.manual_seed(0)
    path = folder / f"{name}.zip"
    MODELS[name]().save(path)
    return path


def rewrite(path: Path, target: Path, **changed: bytes | None) -> Path:
    """Copy a zip file with some members changed, added, or left out; ``__`` stands for a dot in their names."""
    members = {name.replace("__", "."): content for name, content in changed.items()}
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = members.pop(name, old.read(name))
            if content is not None:
                new.writestr(name, content)
        for name, content in members.items():
            if content is not None:
                new.writestr(name, content)
    return target


def read_data(path: Path) -> dict[str, Any]:
    with zipfile.ZipFile(path) as archive:
        found: dict[str, Any] = json.loads(archive.read("data"))
    return found


def as_of_2021(path: Path) -> None:
    """Rewrite a PPO model as stable-baselines3 1.0 wrote it: its spaces are gym's, and its first layers are shared.

    The first layers of actor and critic must have the same numbers.
    """
    sides = [f"mlp_extractor.{side}_net." for side in ("policy", "value")]
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    tensors, old = th.load(io.BytesIO(members["policy.pth"]), weights_only=True), {}
    for name, tensor in tensors.items():
        side = next((each for each in sides if name.startswith(each)), None)
        number, _, kind = name.removeprefix(side or "").partition(".")
        if side is None:
            old[name] = tensor
        elif number == "0":
            old[f"mlp_extractor.shared_net.0.{kind}"] = tensor
        else:
            old[f"{side}{int(number) - 2}.{kind}"] = tensor
    order = sorted(old, key=lambda name: ("." in name, not name.startswith("mlp"), "shared" not in name))
    old = {name: old[name] for name in order}
    optimizer = th.optim.Adam([tensor.requires_grad_() for tensor in old.values()], lr=0.0)
    sum(tensor.sum() for tensor in old.values()).backward()
    optimizer.step()
    for part, content in (
        ("policy", {name: t.detach() for name, t in old.items()}),
        ("policy.optimizer", optimizer.state_dict()),
    ):
        written = io.BytesIO()
        th.save(content, written)
        members[f"{part}.pth"] = written.getvalue()
    data = json.loads(members["data"])
    data["policy_kwargs"]["net_arch"] = [6, {"pi": [5], "vf": [4]}]
    for name in ("observation_space", "action_space"):
        data[name] |= {
            ":type:": "<class 'gym.spaces.box.Box'>",
            ":serialized:": _pickled_by_gym(data[name][":serialized:"]),
        }
    members["data"] = json.dumps(data).encode()
    with zipfile.ZipFile(path, "w") as file:
        for name, member in members.items():
            file.writestr(name, member)


def _pickled_by_gym(serialized: str) -> str:
    """Return the pickle of a Box as of gym's class."""
    space = pickle.loads(base64.b64decode(serialized))
    module = types.ModuleType("gym.spaces.box")
    module.Box = type("Box", (), {"__module__": module.__name__})  # type: ignore[attr-defined]
    box = module.Box()  # type: ignore[attr-defined]
    box.__dict__.update({name: value for name, value in vars(space).items() if not name.endswith("_repr")})
    with pytest.MonkeyPatch.context() as patch:
        for name in ("gym", "gym.spaces", module.__name__):
            patch.setitem(sys.modules, name, module)
        return base64.b64encode(pickle.dumps(box)).decode()

"""Files that would write another file if anything in them were executed."""

from __future__ import annotations

import base64
import contextlib
import io
import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import stable_baselines3 as sb3
import stock_models
import torch as th
from stable_baselines3.common.buffers import ReplayBuffer

from frobs_algos_sb3.model_files import archive as archives
from frobs_algos_sb3.model_files import load_model, read_replay_buffer
from frobs_core.util.errors import CheckpointError, FrobsError, UntrustedFileError

PENDULUM = ("sac-sde", "td3-layers", "ppo-layers")
FIELDS = {
    name: [*stock_models.MODELS[name]().__dict__, "policy_class"] for name in PENDULUM
}  # every attribute: any of them may be made a pickle


class Payload:
    """Writes a file when it is unpickled."""

    def __init__(self, target: Path) -> None:
        self._target = target

    def __reduce__(self) -> Any:
        return Path.touch, (self._target,)


@pytest.fixture
def touched(tmp_path: Path) -> Path:
    return tmp_path / "executed"


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("stock")
    return {name: stock_models.write(name, folder) for name in PENDULUM}


def poison(path: Path, target: Path, field: str, touched: Path, readable: bool) -> Path:
    """Make one field of ``data`` a pickle that executes; ``readable``: leave what stands beside it."""
    data = stock_models.read_data(path)
    beside = data.get(field) if readable and isinstance(data.get(field), dict) else {":type:": "<class 'dict'>"}
    payload = base64.b64encode(pickle.dumps(Payload(touched))).decode()
    data[field] = {**beside, ":serialized:": payload}
    return stock_models.rewrite(path, target, data=json.dumps(data).encode())


def test_the_payload_works(tmp_path: Path, touched: Path) -> None:
    pickle.loads(pickle.dumps(Payload(touched)))
    assert touched.exists()


@pytest.mark.parametrize(
    ("name", "field", "readable"),
    [(name, field, True) for name, fields in FIELDS.items() for field in fields]
    + [("sac-sde", field, False) for field in FIELDS["sac-sde"]],
)
def test_a_malicious_field_is_refused_or_ignored(
    name: str, field: str, readable: bool, stock: dict[str, Path], tmp_path: Path, touched: Path
) -> None:
    path = poison(stock[name], tmp_path / "model.zip", field, touched, readable)
    env = gym.make("Pendulum-v1")
    spaces = env.observation_space, env.action_space
    for given in ({}, {"spaces": spaces}, *([{"env": env}] if readable else [])):  # what only training needs, too
        with contextlib.suppress(FrobsError):
            load_model(path, **given)
    assert not touched.exists()


@pytest.mark.parametrize("name", PENDULUM)
def test_every_field_at_once_is_refused(name: str, stock: dict[str, Path], tmp_path: Path, touched: Path) -> None:
    path = stock[name]
    for number, field in enumerate(FIELDS[name]):
        path = poison(path, tmp_path / f"{number}.zip", field, touched, readable=False)
    for env in (None, gym.make("Pendulum-v1")):
        with pytest.raises(FrobsError, match="--trust or trust=True" if env is None else "."):
            load_model(path, env)
    assert not touched.exists()


def members() -> list[tuple[str, str]]:
    return [
        ("sac-sde", member)
        for member in ("policy.pth", "actor.optimizer.pth", "critic.optimizer.pth", "ent_coef_optimizer.pth", "pytorch_variables.pth")
    ] + [("ppo-layers", "policy.optimizer.pth"), ("td3-layers", "another.pth")]  # fmt: skip


def as_torch(content: Any) -> bytes:
    file = io.BytesIO()
    th.save(content, file)
    return file.getvalue()


@pytest.mark.parametrize(("name", "member"), members())
@pytest.mark.parametrize("how", ["zip", "legacy", "bare"])
def test_a_malicious_tensor_file_is_refused(
    name: str, member: str, how: str, stock: dict[str, Path], tmp_path: Path, touched: Path
) -> None:
    payload = {"weights": Payload(touched)}
    content = pickle.dumps(payload) if how == "bare" else b""
    if how != "bare":
        file = io.BytesIO()
        th.save(payload, file, _use_new_zipfile_serialization=how == "zip")
        content = file.getvalue()
    path = stock_models.rewrite(stock[name], tmp_path / "model.zip", **{member.replace(".", "__"): content})
    with pytest.raises(FrobsError, match=str(path)):
        load_model(path)
    assert not touched.exists()


@pytest.mark.parametrize("member", ["system_info.txt", "_stable_baselines3_version", "notes.txt"])
def test_a_malicious_text_is_ignored(member: str, stock: dict[str, Path], tmp_path: Path, touched: Path) -> None:
    content = pickle.dumps(Payload(touched))
    path = stock_models.rewrite(stock["td3-layers"], tmp_path / "model.zip", **{member.replace(".", "__"): content})
    env = gym.make("Pendulum-v1")
    assert isinstance(load_model(path, spaces=(env.observation_space, env.action_space)), sb3.TD3)
    assert not touched.exists()


@pytest.mark.parametrize("how", ["pickle", "array of objects"])
def test_a_malicious_replay_buffer_is_refused(how: str, tmp_path: Path, touched: Path) -> None:
    path = tmp_path / "model_replay_buffer.npz"
    if how == "pickle":
        path.write_bytes(pickle.dumps(Payload(touched)))
    else:
        with path.open("wb") as file:
            np.savez(file, observations=np.array([Payload(touched)], dtype=object), allow_pickle=True)
    space = gym.spaces.Box(-1, 1, (2,))
    with pytest.raises(UntrustedFileError, match="--trust"):
        read_replay_buffer(ReplayBuffer(4, space, space), path)
    assert not touched.exists()


@pytest.mark.parametrize("name", ["../escape.pth", "/etc/x", "a/b", "..\\x", ".hidden"])
def test_a_name_that_leads_elsewhere_is_refused(name: str, stock: dict[str, Path], tmp_path: Path) -> None:
    path = stock_models.rewrite(stock["td3-layers"], tmp_path / "model.zip", **{name.replace(".", "__"): b"x"})
    with pytest.raises(CheckpointError, match="rejected: it contains an unexpected file named"):
        load_model(path)


def test_two_files_of_one_name_are_refused(stock: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "model.zip"
    path.write_bytes(stock["td3-layers"].read_bytes())
    with zipfile.ZipFile(path, "a") as file, pytest.warns(UserWarning, match="Duplicate"):
        file.writestr("data", "{}")
    with pytest.raises(CheckpointError, match="two files with the same name"):
        load_model(path)


@pytest.mark.parametrize("inner", [False, True], ids=["in the model", "in its tensors"])
def test_a_zip_bomb_is_refused(inner: bool, stock: dict[str, Path], tmp_path: Path) -> None:
    zeros = bytes(50_000_000)
    path = tmp_path / "model.zip"
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("archive/data/0" if inner else "data", zeros)
    if inner:
        stock_models.rewrite(stock["td3-layers"], path, policy__pth=bomb.getvalue())
    else:
        path.write_bytes(bomb.getvalue())
    with pytest.raises(CheckpointError, match="to 50,000,000 bytes when unpacked"):
        load_model(path)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"[" * 100_000, "not valid JSON"),
        (b"[1]", "not a JSON object"),
        (b"\xff", "not valid JSON"),
        (b"{", "not valid JSON"),
        (b'{"a": ' + b"9" * 10_000 + b"}", "not valid JSON"),
    ],
    ids=["deep", "list", "no text", "cut", "long number"],
)
def test_damaged_json_is_named(data: bytes, message: str, stock: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match=message):
        load_model(stock_models.rewrite(stock["td3-layers"], tmp_path / "model.zip", data=data))


def test_oversized_json_is_refused(stock: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archives, "MAX_JSON_BYTES", 1000)
    with pytest.raises(CheckpointError, match="more than the limit of 1,000 bytes"):
        load_model(stock["td3-layers"])


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("policy_kwargs", {"net_arch": [10**9]}),
        ("policy_kwargs", {"net_arch": [[[]]]}),
        ("policy_kwargs", {"features_extractor_class": "<class 'os.system'>"}),
        ("policy_kwargs", {"n_critics": 10**9}),
        ("policy_kwargs", {"surprise": 1}),
        ("policy_kwargs", "text"),
        ("gamma", "text"),
        ("gamma", [1] * 9),
        ("buffer_size", 10**15),
        ("n_envs", 10**15),
        ("learning_rate", "lin_1"),
        ("observation_space", {":type:": "<class 'gymnasium.spaces.box.Box'>", "_shape": [10**9]}),
        ("action_space", {":type:": "<class 'os.path'>"}),
        ("action_space", None),
        ("use_sde", {}),
    ],
)
def test_nonsense_in_a_field_is_an_error_of_ours(
    field: str, value: Any, stock: dict[str, Path], tmp_path: Path
) -> None:
    data = stock_models.read_data(stock["td3-layers"])
    data[field] = value
    path = stock_models.rewrite(stock["td3-layers"], tmp_path / "model.zip", data=json.dumps(data).encode())
    with pytest.raises(FrobsError, match=str(path)):
        load_model(path, gym.make("Pendulum-v1"), train_freq=1)


def test_a_tensor_that_claims_more_than_it_holds_is_refused(stock: dict[str, Path], tmp_path: Path) -> None:
    huge = as_torch({"weight": th.zeros(1).expand(10**6, 10**6)})
    with pytest.raises(CheckpointError, match="is larger than the stored data"):
        load_model(stock_models.rewrite(stock["td3-layers"], tmp_path / "model.zip", policy__pth=huge))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_file_that_was_cut_is_named(share: float, stock: dict[str, Path], tmp_path: Path) -> None:
    content = stock["td3-layers"].read_bytes()
    path = tmp_path / "model.zip"
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(CheckpointError, match=r"damaged|rejected"):
        load_model(path)
    with pytest.raises(CheckpointError, match="does not exist"):
        load_model(tmp_path / "nothing")


def test_a_flipped_bit_is_reported_as_damage_or_changes_nothing(stock: dict[str, Path], tmp_path: Path) -> None:
    data, flipped = stock["td3-layers"].read_bytes(), tmp_path / "flipped.zip"
    damaged = 0
    for place in range(0, len(data), max(1, len(data) // 150)):
        flipped.write_bytes(data[:place] + bytes([data[place] ^ (1 << place % 8)]) + data[place + 1 :])
        try:
            archives.read_archive(flipped)
        except (CheckpointError, UntrustedFileError):
            damaged += 1
    assert damaged > 100  # the others are dates and attributes of the archive

"""Checks that run in the Python of LeRobot; ``lerobot_exchange.py`` starts this script.

Each subcommand prints its results as JSON in the last line of stdout.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ["HF_HUB_OFFLINE"] = "1"

import numpy as np

REPO, PICTURES = "frobs/exchange", "observation.images."
DEFAULT_COLUMNS = ("timestamp", "frame_index", "episode_index", "index", "task_index")
APPENDED = 20
"""Number of frames of the episode that LeRobot appends."""


def open_set(folder: Path, **options: Any) -> Any:
    """Return LeRobot's reader of a data set."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    return LeRobotDataset(REPO, root=folder, **options)


def read(folder: Path, truth: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, Any]:
    """Read all frames with each video backend, and compare them with what FRobs reads.

    Args:
        folder: The data set.
        truth: All columns and pictures by name.
    """
    result: dict[str, Any] = {"frames": len(next(iter(truth.values()))), "columns": [], "pictures": {}}
    for backend in ("pyav", "torchcodec"):
        data, largest = open_set(folder, video_backend=backend), 0
        try:
            for index in range(len(data)):
                frame = data[index]
                for name, values in truth.items():
                    found = frame[name].numpy()
                    if name.startswith(PICTURES):
                        found = np.rint(found.transpose(1, 2, 0) * 255.0)
                        largest = max(largest, int(np.abs(found - values[index]).max()))
                    elif found.dtype != values.dtype or found.tobytes() != values[index].tobytes():
                        raise SystemExit(f"frame {index}: {name} is {found}, but FRobs reads {values[index]}")
        except (ImportError, OSError, RuntimeError) as error:
            result["pictures"][backend] = str(error).partition("\n")[0][:120]
            continue
        assert len(data) == result["frames"]
        result["pictures"][backend] = largest
        result["columns"] = [name for name in truth if not name.startswith(PICTURES)]
    return result


def read_windows(folder: Path, truth: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, Any]:
    """Read actions ahead and states before with ``delta_timestamps``, at the ends of episodes too."""
    step, wrong = 1.0 / open_set(folder).fps, 0
    data = open_set(
        folder,
        video_backend="pyav",
        delta_timestamps={"action": [0.0, step, 2.0 * step], "observation.state": [-step, 0.0]},
    )
    episode = truth["episode_index"].ravel()
    for index in range(len(data)):
        inside = np.flatnonzero(episode == episode[index])
        frame = data[index]
        for name, offsets in {"action": (0, 1, 2), "observation.state": (-1, 0)}.items():
            wanted = [index + offset for offset in offsets]
            rows = np.clip(wanted, inside[0], inside[-1])
            is_equal = np.array_equal(frame[name].numpy(), truth[name][rows])
            wrong += not is_equal or frame[f"{name}_is_pad"].tolist() != (rows != wanted).tolist()
    return {"windows": 2 * len(data), "wrong": wrong}


def append_and_merge(folder: Path, appended: Path, merged: Path) -> dict[str, Any]:
    """Append an episode to a copy of the data set with LeRobot, and merge the copy with the original."""
    from lerobot.datasets.dataset_tools import merge_datasets
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    shutil.copytree(folder, appended)
    data = LeRobotDataset.resume(REPO, root=appended)
    for index in range(APPENDED):
        frame: dict[str, Any] = {"task": "Do something else."}
        for name, feature in data.features.items():
            if name not in DEFAULT_COLUMNS:
                dtype = "uint8" if feature["dtype"] == "video" else feature["dtype"]
                frame[name] = np.full(feature["shape"], index % 2, dtype)
        data.add_frame(frame)
    data.save_episode()
    data.finalize()
    both = merge_datasets([open_set(folder), open_set(appended)], output_repo_id=REPO, output_dir=merged)
    last = both[len(both) - 1]
    assert last["task"] == "Do something else."
    return {"episodes": both.num_episodes, "frames": len(both)}


def drive_expert(task: str, episodes: int) -> dict[str, Any]:
    """Let LeRobot's own rollout play episodes in which the expert of FRobs acts."""
    import torch
    from lerobot.envs.factory import make_env, make_env_config
    from lerobot.scripts.lerobot_eval import rollout
    from lerobot.utils.import_utils import register_third_party_plugins

    from frobs_core import load_policy

    register_third_party_plugins()
    config = make_env_config("frobs", task=task)
    env = make_env(config, n_envs=episodes, use_async_envs=False)["frobs"][0]

    class Expert(torch.nn.Module):
        def reset(self) -> None:
            self.experts = [load_policy("expert", each.unwrapped) for each in env.envs]
            self.start = np.array([True])

        def select_action(self, batch: Mapping[str, Any]) -> torch.Tensor:
            actions = [each.act(None, self.start) for each in self.experts]
            self.start = np.array([False])
            self.seen = {name: list(value.shape[1:]) for name, value in batch.items() if hasattr(value, "shape")}
            self.sentence = batch["task"][0]
            return torch.as_tensor(np.concatenate(actions), dtype=torch.float32)

    policy = Expert()
    same = dict.fromkeys(("env_preprocessor", "env_postprocessor", "preprocessor", "postprocessor"), lambda each: each)
    found = rollout(env, policy, **same, seeds=list(range(episodes)))
    env.close()
    success = found["success"].any(1).tolist()
    return {"episodes": episodes, "successes": sum(success), "seen": policy.seen, "sentence": policy.sentence}


def main() -> None:
    """Run the checks that the command line names."""
    task, *arguments = sys.argv[1:]
    if task == "versions":
        names = ("lerobot", "torch", "torchcodec", "av", "pyarrow", "numpy", "gymnasium", "mujoco")
        result: dict[str, Any] = {"Python": platform.python_version()} | {name: version(name) for name in names}
    elif task == "read":
        folder, truth = Path(arguments[0]), dict(np.load(arguments[1]))
        result = {**read(folder, truth), **read_windows(folder, truth)}
    elif task == "edit":
        result = append_and_merge(*map(Path, arguments))
    else:
        result = drive_expert(arguments[0], int(arguments[1]))
    sys.stdout.write(f"\n{json.dumps(result)}\n")


if __name__ == "__main__":
    main()

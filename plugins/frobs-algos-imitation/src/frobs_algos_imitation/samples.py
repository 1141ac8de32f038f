"""The samples that a network learns from: windows of observations and actions, and the actions to imitate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch as th

from frobs_algos import storage
from frobs_core.util.arrays import Mask
from frobs_core.util.errors import CheckpointError

Array = np.ndarray[Any, Any]
_PICTURES = "pictures_"


class Samples:
    """Frames of whole episodes, one episode after another, with the labels of the frames.

    A frame is a flat observation. For a policy with a memory, the previous action follows, which is zero at the start of
    an episode.

    Attributes:
        frames: (n, frame size) float32.
        labels: Actions to imitate, (n, action size) float32.
        parts: Arrays of which the samples consist.
        starts: Index of the first frame of each frame's episode, (n,).
        ends: Index after the last frame of each frame's episode, (n,).
        imitated: Whether the label of a frame is imitated, (n,) bool.
        rows: Indices of the frames whose labels are imitated.

    The pictures of each part remain where they are, so that each one is in memory once.
    """

    def __init__(self, parts: Sequence[Mapping[str, Array]]) -> None:
        self.parts = [*parts]
        joined = {
            name: np.concatenate([part[name] for part in parts]) for name in ("frames", "labels", "episode_start")
        }
        first = np.flatnonzero(joined["episode_start"])
        lengths = np.diff([*first, len(joined["frames"])])
        self.frames, self.labels = th.from_numpy(joined["frames"]), th.from_numpy(joined["labels"])
        self.starts = th.from_numpy(np.repeat(first, lengths))
        self.ends = th.from_numpy(np.repeat(first + lengths, lengths))
        # Parts of checkpoints that an earlier version wrote contain only labels to imitate.
        imitated = [part.get("imitated", np.ones(len(part["frames"]), np.bool_)) for part in parts]
        self.imitated = th.from_numpy(np.concatenate(imitated))
        self.rows = th.nonzero(self.imitated).flatten()
        self._offsets = th.from_numpy(np.cumsum([0, *(len(part["frames"]) for part in parts)]))
        self._pictures = [
            [th.from_numpy(part[name]) for part in parts] for name in parts[0] if name.startswith(_PICTURES)
        ]

    @classmethod
    def of(
        cls,
        frames: Array,
        action: Array | None,
        label: Array,
        episode_start: Mask,
        imitated: Mask | None = None,
        pictures: Mapping[str, Array] | None = None,
    ) -> Samples:
        """Return the samples of n steps.

        Args:
            frames: Flat observations before the actions, (n, size) float32.
            action: Actions that the environment received, (n, …), or None for a policy without a memory.
            label: Actions to imitate, (n, …).
            episode_start: (n,) bool.
            imitated: Whether the action of each step is imitated, (n,) bool, or None for all steps. The other steps are
                only seen by a policy with a memory.
            pictures: Pictures before the actions by camera, (n, height, width, channels) uint8.
        """
        if action is not None:
            previous = np.roll(action.reshape(len(action), -1).astype(np.float32), 1, axis=0)
            previous[episode_start] = 0.0
            frames = np.concatenate([frames, previous], axis=1)
        labels = label.reshape(len(label), -1).astype(np.float32)
        part = {"frames": frames, "labels": labels, "episode_start": episode_start}
        part |= {f"{_PICTURES}{name}": array for name, array in (pictures or {}).items()}
        return cls([part if imitated is None or imitated.all() else {**part, "imitated": imitated}])

    def __add__(self, other: Samples) -> Samples:
        """Return the samples of both."""
        return Samples([*self.parts, *other.parts])

    def write(self, folder: Path, previous: Path | None) -> None:
        """Write each part to a file of a new folder. Files of an earlier checkpoint become hard links."""
        folder.mkdir()
        for index, part in enumerate(self.parts):
            name = f"part_{index:05d}.npz"
            if previous is None or not storage.link(previous / name, folder / name):
                storage.write_arrays(folder / name, part)

    @classmethod
    def read(cls, folder: Path) -> Samples:
        """Read what :meth:`write` wrote, or raise CheckpointError if a file is missing or damaged."""
        paths = sorted(folder.glob("part_*.npz"))
        if [path.name for path in paths] != [f"part_{index:05d}.npz" for index in range(max(1, len(paths)))]:
            raise CheckpointError(f"{folder} is damaged: a part is missing.")
        return cls([storage.read_arrays(path) for path in paths])

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.frames)

    def pictures(self, indices: th.Tensor) -> list[th.Tensor]:
        """Return the pictures of frames, (batch, height, width, channels) uint8 for each camera."""
        places = th.bucketize(indices, self._offsets, right=True) - 1
        seen = []
        for parts in self._pictures:
            seen.append(th.empty((len(indices), *parts[0].shape[1:]), dtype=th.uint8))
            for number, part in enumerate(parts):
                rows = places == number
                seen[-1][rows] = part[indices[rows] - self._offsets[number]]
        return seen

    def batch(self, indices: th.Tensor, history: int, chunk: int) -> tuple[th.Tensor, th.Tensor, th.Tensor]:
        """Return windows (batch, history, frame size), labels (batch, chunk, action size) and their validity.

        Before the first frame of an episode, the first frame is repeated. Labels after the last frame of an episode,
        and labels that are not imitated, are not valid. The validity is (batch, chunk) bool.
        """
        back = indices[:, None] + th.arange(1 - history, 1)
        ahead = indices[:, None] + th.arange(chunk)
        windows = self.frames[th.maximum(back, self.starts[indices, None])]
        last = self.ends[indices, None]
        labeled = th.minimum(ahead, last - 1)
        return windows, self.labels[labeled], (ahead < last) & self.imitated[labeled]

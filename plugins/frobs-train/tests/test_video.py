from __future__ import annotations

import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from frobs_core.util.errors import ConfigurationError, RunError
from frobs_train import Run, record_video


def test_a_video_plays_in_a_browser(trained: Run, tmp_path: Path) -> None:
    path = record_video(trained, tmp_path / "out" / "video.mp4", episodes=2)
    tool = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path)]
    facts = subprocess.run(tool, capture_output=True, text=True, check=False).stderr
    assert "Video: h264" in facts
    assert "yuv420p" in facts
    assert "62x46" in facts
    assert "10 fps" in facts
    raw = subprocess.run([*tool, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout
    frames = np.frombuffer(raw, np.uint8).reshape(-1, 46, 62, 3)
    assert len(frames) == 22
    assert frames[0].max() > 150
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # plays before it is loaded to the end
    assert [item.name for item in path.parent.iterdir()] == ["video.mp4"]


def test_a_video_goes_into_the_run(copied: Run) -> None:
    assert record_video(copied, episodes=1) == copied.path / "video.mp4"


def test_an_environment_that_draws_nothing_leaves_nothing(copied: Run, tmp_path: Path) -> None:
    blind = Run(copied.path, copied.config.model_copy(update={"environment": "FrobsTests/Blind-v0"}))
    with pytest.raises(RunError, match="does not render RGB images"):
        record_video(blind, tmp_path / "out" / "video.mp4")
    assert not (tmp_path / "out").exists()


def test_bad_arguments_are_named(trained: Run) -> None:
    with pytest.raises(ConfigurationError, match="episodes is 0"):
        record_video(trained, episodes=0)
    with pytest.raises(ConfigurationError, match=r"ends in \.mp4"):
        record_video(trained, "video.avi")

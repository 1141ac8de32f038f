from __future__ import annotations

import resource
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from frobs_core.util.errors import CheckpointError, RunError
from frobs_train import Run, RunConfig
from frobs_train.runs.checkpoints import list_checkpoints, newest_checkpoint, write_checkpoint


def write(folder: Path, steps: int, size: int = 100, keep: int = 3) -> None:
    def save(path: Path) -> None:
        (path / "policy.pt").write_bytes(bytes(size))

    write_checkpoint(folder, steps, save, keep)


def test_a_checkpoint_is_complete_and_the_oldest_go(tmp_path: Path) -> None:
    for steps in (10, 200, 3000):
        write(tmp_path, steps, keep=2)
    assert [item.steps for item in list_checkpoints(tmp_path)] == [200, 3000]
    for item in list_checkpoints(tmp_path):
        item.verify()
    assert not list(tmp_path.glob(".*"))


def test_a_failure_while_saving_leaves_nothing(tmp_path: Path) -> None:
    write(tmp_path, 10)

    def save(path: Path) -> None:
        (path / "half").write_bytes(b"x")
        raise OSError(28, "No space left on device")

    with pytest.raises(CheckpointError, match=r"step_000000020 cannot be written: .*No space left.* MiB are free"):
        write_checkpoint(tmp_path, 20, save, 3)
    assert [path.name for path in tmp_path.iterdir()] == ["step_000000010"]


def test_an_interrupt_while_saving_leaves_nothing(tmp_path: Path) -> None:
    def save(path: Path) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_checkpoint(tmp_path, 20, save, 3)
    assert not list(tmp_path.iterdir())


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A real file system of 128 KiB."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=128k", "tmpfs", str(tmp_path)], check=True)
    yield tmp_path
    subprocess.run(["umount", "--lazy", str(tmp_path)], check=True)


def test_a_full_disk_is_named_and_earlier_checkpoints_are_intact(small_disk: Path) -> None:
    folder = small_disk / "checkpoints"
    write(folder, 10, 40_000)
    with pytest.raises(CheckpointError, match=r"step_000000020 cannot be written: .*No space left.*0\.\d MiB are free"):
        write(folder, 20, 100_000)
    assert [path.name for path in folder.iterdir()] == ["step_000000010"]
    newest_checkpoint(folder)[0].verify()
    write(folder, 30, 40_000)


def test_a_file_size_limit_is_a_full_disk_too(tmp_path: Path) -> None:
    write(tmp_path, 10)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(CheckpointError, match="cannot be written"):
            write(tmp_path, 20, 100_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in tmp_path.iterdir()] == ["step_000000010"]


def test_a_run_that_has_no_room_for_its_configuration_leaves_nothing(small_disk: Path) -> None:
    (small_disk / "ballast").write_bytes(bytes(127 * 1024 - 4096))
    with pytest.raises(RunError, match=r"cannot be written: .*No space left"):
        Run.create(small_disk / "run", RunConfig(environment="X-v0", environment_kwargs={"x": "y" * 60_000}))
    assert [path.name for path in small_disk.iterdir()] == ["ballast"]


@pytest.mark.parametrize("damage", ["cut", "changed", "missing"])
def test_a_damaged_checkpoint_is_passed_over_and_named(damage: str, tmp_path: Path) -> None:
    write(tmp_path, 10)
    write(tmp_path, 20)
    file = tmp_path / "step_000000020" / "policy.pt"
    if damage == "missing":
        file.unlink()
    else:
        file.write_bytes(bytes(50) if damage == "cut" else b"x" * 100)
    checkpoint, damaged = newest_checkpoint(tmp_path)
    assert checkpoint.steps == 10
    assert len(damaged) == 1
    assert "step_000000020: policy.pt" in damaged[0]


def test_no_usable_checkpoint_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="no usable checkpoint: none was written"):
        newest_checkpoint(tmp_path)


def test_debris_of_a_killed_process_does_not_count(tmp_path: Path) -> None:
    write(tmp_path, 10)
    (tmp_path / ".step_000000020.4711").mkdir()
    (tmp_path / "step_000000030").mkdir()  # without checksums
    assert [item.steps for item in list_checkpoints(tmp_path)] == [10]

"""Reading and writing of stable-baselines3's model files, without executing code in the files."""

from frobs_algos_sb3.model_files.archive import ModelArchive, read_archive
from frobs_algos_sb3.model_files.buffers import read_replay_buffer, write_replay_buffer
from frobs_algos_sb3.model_files.load import load_model
from frobs_algos_sb3.model_files.save import save_model, sidecar_path

__all__ = [
    "ModelArchive",
    "load_model",
    "read_archive",
    "read_replay_buffer",
    "save_model",
    "sidecar_path",
    "write_replay_buffer",
]

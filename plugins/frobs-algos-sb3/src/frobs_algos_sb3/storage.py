"""The reader and writer of files, where version 0.2 had it."""

from frobs_algos.storage import (
    check_networks,
    read_arrays,
    read_json,
    read_tensors,
    write_arrays,
    write_json,
    write_tensors,
)

__all__ = ["check_networks", "read_arrays", "read_json", "read_tensors", "write_arrays", "write_json", "write_tensors"]

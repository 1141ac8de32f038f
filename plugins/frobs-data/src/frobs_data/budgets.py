"""Limits for data sets from strangers."""

from __future__ import annotations

from collections.abc import Mapping

BUDGET: Mapping[str, int] = {
    "bytes of a data file": 16 * 2**30,
    "bytes of a metadata file, decompressed": 2**30,
    "bytes of a start state": 64 * 2**20,
    "bytes of a video file": 16 * 2**30,
    "bytes of decoded pictures in memory": 8 * 2**30,
    "elements of a feature": 100_000,
    "episodes": 1_000_000,
    "features": 1_000,
    "frames": 100_000_000,
    "frames per second": 10_000,
    "pixels of a picture": 4096 * 4096,
    "tasks": 100_000,
}
"""Limits by what is counted."""

BAG_BUDGET: Mapping[str, int] = {
    "bytes of a chunk, decompressed": 2**28,
    "bytes of a file": 16 * 2**30,
    "bytes of a message": 2**26,
    "elements of a message": 100_000,
    "messages": 20_000_000,
    "topics": 10_000,
}
"""Limits for ROS bags."""

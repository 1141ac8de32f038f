"""The part of SDF that the bridge understands."""

from __future__ import annotations

from frobs_core.errors import ModelFileError
from frobs_ros.bridge.model import Description


def describe_sdf(text: str) -> Description:
    """Read a model.

    Raises:
        ModelFileError: It says what the bridge does not understand.
    """
    raise ModelFileError("SDF", "SDF is not understood yet.")

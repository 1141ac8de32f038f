"""The base class for algorithms."""

from frobs_algos_sb3.frobs_rl import BasicModel as _BasicModel
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["BasicModel"]


class BasicModel(AcceptsBothApis, _BasicModel):
    """Version of :class:`frobs_algos_sb3.frobs_rl.BasicModel` that also accepts environments with the old gym API."""

"""The base class of the algorithms."""

from frobs_algos_sb3.frobs_rl import BasicModel as _BasicModel
from frobs_rl_compat.models import AcceptsBothApis

__all__ = ["BasicModel"]


class BasicModel(AcceptsBothApis, _BasicModel):
    """Base class of the algorithms: :class:`frobs_algos_sb3.frobs_rl.BasicModel`."""

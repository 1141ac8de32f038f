"""The base class for algorithms."""

from frobs_rl_compat.models import AcceptsBothApis
from frobs_rl_compat.training import BasicModel as _BasicModel

__all__ = ["BasicModel"]


class BasicModel(AcceptsBothApis, _BasicModel):
    """Version of :class:`frobs_rl_compat.training.BasicModel` that also accepts environments with the old gym API."""

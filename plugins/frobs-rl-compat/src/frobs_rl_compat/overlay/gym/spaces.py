"""Gymnasium's spaces, also under gym's submodule names such as ``gym.spaces.box``, which old model files use."""

import sys
from importlib import import_module

from gymnasium.spaces import *
from gymnasium.spaces import __all__ as __all__

for _kind in ("box", "dict", "discrete", "multi_binary", "multi_discrete", "space", "tuple"):
    sys.modules[f"{__name__}.{_kind}"] = globals()[_kind] = import_module(f"gymnasium.spaces.{_kind}")

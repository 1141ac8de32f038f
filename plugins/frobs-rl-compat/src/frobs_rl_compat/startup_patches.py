"""Makes packages from 2021 work with current NumPy in processes started by 'frobs legacy run'.

Python imports this module at startup. When a process imports NumPy, this module restores names that newer versions of
NumPy removed. The module also makes ``tf.transformations`` accept one-element arrays as numbers again, and suppresses
the traceback after Ctrl-C.
"""

import functools
import os
import sys
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import module_from_spec
from typing import Any

_ALIASES = {
    "Inf": "inf", "Infinity": "inf", "NAN": "nan", "NaN": "nan", "alltrue": "all", "complex_": "complex128",
    "cumproduct": "cumprod", "float_": "float64", "in1d": "isin", "infty": "inf", "product": "prod", "round_": "round",
    "row_stack": "vstack", "sometrue": "any", "string_": "bytes_", "trapz": "trapezoid", "unicode_": "str_",
}  # fmt: skip
_BUILTINS = (bool, complex, float, int, object, str)
_FILE_FUNCTIONS = ("fromregex", "genfromtxt", "load", "loadtxt", "save", "savetxt", "savez", "savez_compressed")
_ANGLE_FUNCTIONS = ("euler_matrix", "quaternion_about_axis", "quaternion_from_euler", "rotation_matrix")


def _restore_numpy(numpy: Any) -> None:
    for old, new in _ALIASES.items():
        if old not in vars(numpy):
            setattr(numpy, old, getattr(numpy, new))
    for builtin in _BUILTINS:
        vars(numpy).setdefault(builtin.__name__, builtin)


def _restore_npyio(npyio: Any) -> None:
    for name in _FILE_FUNCTIONS:
        if name not in vars(npyio):
            setattr(npyio, name, getattr(import_module("numpy.lib._npyio_impl"), name))


def _take_one_element(transformations: Any) -> None:
    import numpy as np

    def wrap(function: Any) -> Any:
        @functools.wraps(function)
        def wrapped(*args: Any, **kwargs: Any) -> Any:
            numbers = (arg.item() if isinstance(arg, np.ndarray) and arg.size == 1 else arg for arg in args)
            return function(*numbers, **kwargs)

        return wrapped

    for name in _ANGLE_FUNCTIONS:
        setattr(transformations, name, wrap(getattr(transformations, name)))


_PATCHES = {"numpy": _restore_numpy, "numpy.lib.npyio": _restore_npyio, "tf.transformations": _take_one_element}


class _Patcher(MetaPathFinder):
    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path) if name in _PATCHES else None
        if spec is None or spec.loader is None:
            return None
        execute = spec.loader.exec_module

        def execute_and_patch(module: Any) -> None:
            execute(module)
            _PATCHES[name](module)

        spec.loader.exec_module = execute_and_patch  # type: ignore[method-assign]
        return spec


def _end_quietly(kind: type[BaseException], error: BaseException, traceback: Any) -> None:
    """Print the traceback of an error, except for errors that Ctrl-C caused in Python or in rospy."""
    if not (issubclass(kind, KeyboardInterrupt) or kind.__name__ == "ROSInterruptException"):
        sys.__excepthook__(kind, error, traceback)


def _run_next() -> None:
    """Run the ``sitecustomize`` module that this module shadows."""
    own = os.path.dirname(__file__)
    spec = PathFinder.find_spec("sitecustomize", [entry for entry in sys.path if entry != own])
    if spec is not None and spec.loader is not None:
        spec.loader.exec_module(module_from_spec(spec))


sys.meta_path.insert(0, _Patcher())
sys.excepthook = _end_quietly
_run_next()

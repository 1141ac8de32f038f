"""Xacro without ROS: the PyPI package ``xacro``, with ``$(find …)`` of our own and its expressions fenced in.

As published, ``$(eval …)`` reaches all of Python, and ``${…}`` does through nested scopes, frames and ``vars``. Here both
go through one check of the expression's syntax tree. What is left: a file can read environment variables
(``$(env …)``) and YAML files, and can use up time and memory, as any program that a macro language allows.
"""

from __future__ import annotations

import ast
import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from frobs_core.errors import ModelFileError
from frobs_core.models.resources import Packages
from frobs_core.models.xacro_errors import Declarations, choices, explain
from frobs_core.models.xmltree import parse_xml, read_bytes

_LOCK = threading.Lock()  # xacro keeps its state in module globals
_FRAMES = frozenset({"gi_frame", "gi_code", "cr_frame", "cr_code", "ag_frame", "ag_code", "format", "format_map"})
_MATH = {name: value for name, value in vars(math).items() if not name.startswith("_")}
_EVAL_NAMES = {
    **_MATH,
    **{kind.__name__: kind for kind in (list, dict, map, str, float, int, bool, len, min, max, round, abs)},
    "true": True,
    "false": False,
}


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Packages) -> str:
    """Return the XML that a xacro file expands to.

    Args:
        path: The file.
        arguments: Values of its ``<xacro:arg>``.
        packages: Where ``$(find …)`` looks.

    Raises:
        ModelFileError: The file, or one that it includes, is broken, has a document type, misses an argument, is given
            one that it does not declare, or names a macro, parameter, property, package or file that does not exist.
    """
    import xacro

    seen = Declarations()
    with _LOCK, _patched(xacro, seen, packages):
        xacro.init_stacks(str(path))
        try:
            document = xacro.parse(None, str(path))
            xacro.process_doc(document, mappings={k: str(v) for k, v in arguments.items()}, verbosity=0)
            text = str(document.documentElement.toxml())
        except ModelFileError:
            raise
        except Exception as error:  # xacro raises all kinds, down to RuntimeError and KeyError
            where = Path((xacro.filestack or [str(path)])[-1])
            raise explain(error, where, seen) from error
        finally:
            xacro.substitution_args_context.clear()
    for name in arguments:
        if name not in seen.arguments:
            raise ModelFileError(path, f"takes no xacro argument '{name}'.{choices(name, seen.arguments)}")
    return text


@contextmanager
def _patched(xacro: Any, seen: Declarations, packages: Packages) -> Iterator[None]:
    """Put our parser, our package look-up and our expression check in the place of xacro's, for one file."""
    from xml.dom import minidom

    from xacro import substitution_args as substitution

    original_eval = xacro.safe_eval

    def parse(inp: Any, filename: str) -> Any:
        file = Path(filename)
        try:
            text = file.read_bytes()
        except OSError as error:
            xacro.filestack.pop()
            # this class with this cause is what <xacro:include optional="true"> forgives
            raise xacro.XacroException(f"{error.strerror}: {file}", exc=error) from error
        seen.note(file, parse_xml(text, file), text)  # refuses a document type, names the line of a mistake
        return minidom.parseString(text)

    def safe_eval(expression: str, symbols: Any, local_symbols: Any = None) -> Any:
        check_expression(expression)
        return original_eval(expression, symbols, local_symbols)

    def eval_extension(expression: str, context: dict[str, Any]) -> str:
        check_expression(expression)
        arguments = {name: substitution.convert_value(value, "auto") for name, value in context.get("arg", {}).items()}
        functions: dict[str, Callable[..., Any]] = {
            "find": find,
            "env": substitution._eval_env,
            "optenv": substitution._eval_optenv,
            "dirname": dirname,
            "arg": lambda name: arguments[name],
        }
        names = {**_EVAL_NAMES, **functions, **arguments, "__builtins__": {}}
        return str(eval(expression.strip(), names))

    def find(package: str) -> str:
        return str(packages.find(package))

    def dirname(_: Any = None) -> str:
        return str(Path(xacro.filestack[-1]).absolute().parent)

    patches: list[tuple[Any, str, Any]] = [
        (xacro, "parse", parse),
        (xacro, "safe_eval", safe_eval),
        (xacro, "eval_extension", _reraising(xacro, xacro.eval_extension)),
        (substitution, "_eval", eval_extension),
        (substitution, "_eval_find", find),
        (substitution, "_eval_dirname", dirname),
    ]
    namespace = xacro._global_symbols["python"]
    variables = namespace.pop("vars", None)  # a way to every attribute
    originals = [(owner, name, getattr(owner, name)) for owner, name, _ in patches]
    try:
        for owner, name, value in patches:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in originals:
            setattr(owner, name, value)
        if variables is not None:
            dict.__setitem__(namespace, "vars", variables)


def _reraising(xacro: Any, eval_extension: Callable[[str], str]) -> Callable[[str], str]:
    """Let our own errors through, which xacro would wrap in its own."""

    def wrapper(text: str) -> str:
        try:
            return eval_extension(text)
        except xacro.XacroException as error:
            if isinstance(error.exc, ModelFileError):
                raise error.exc from error
            raise

    return wrapper


def check_expression(expression: str) -> None:
    """Refuse what leads from an expression to the rest of Python.

    Raises:
        ValueError: The expression uses a name that begins with two underscores, or a frame's attribute.
    """
    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        name = getattr(node, "attr", None) or getattr(node, "id", None) or getattr(node, "arg", None)
        if isinstance(name, str) and (name.startswith("__") or (isinstance(node, ast.Attribute) and name in _FRAMES)):
            raise ValueError(f"'{name}' is not allowed in expressions")


def read_text(path: Path, arguments: Mapping[str, str], packages: Packages) -> tuple[bytes | str, bool]:
    """Return a model file's text and whether macros wrote it: ``.xacro`` is expanded, all else is read.

    Raises:
        ModelFileError: As :func:`expand_xacro`, or arguments are given to a file that is no xacro.
    """
    if path.suffix == ".xacro":
        return expand_xacro(path, arguments, packages), True
    if arguments:
        raise ModelFileError(path, f"takes no xacro arguments ({', '.join(arguments)}): it is no .xacro file.")
    return read_bytes(path), False

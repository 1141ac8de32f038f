"""Docstrings of everything that the reference lists describe the arguments, the shapes, the units and the errors.

The rules look for words, so they find what is missing but not what is wrong. A method inherits the docstrings of the
methods that it overrides, a constructor those of its class, and "For the arguments, see …" adds another docstring.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import pydoc
import re
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from pages import ROOT

from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError, ParameterValueError

sys.path.insert(0, str(ROOT / "docs"))

from generate import api

MODULES = sorted(
    {module for modules in api.MODULES.values() for module in modules}
    | {"frobs_core.plugins.hooks", "frobs_core.plugins.records"}  # they have a page of their own
)
NEEDS_WORDS = re.compile(
    r"\b(str|int|float|bool|Floats|Mask|Action|Array|_Array|NDArray|ndarray|ArrayLike"
    r"|Callable|Sequence|Iterable|Mapping)\b"
)
"""Types of parameters that must be described. A class of FRobs or a path says enough."""
ARRAY = re.compile(r"\b(Floats|Action|Array|_Array|NDArray|ndarray)\b")
"""Types of arrays. The description of ``Mask`` already contains its shape."""
NO_ARRAY = re.compile(r"\b(dict|Mapping)\[str, (npt\.NDArray|np\.ndarray)\[.*|\bEnv\[.*")
"""Types that contain arrays of different shapes, such as snapshots."""
_AXIS = r"(?:[\w+*]+(?: or [\w+*]+)?|\w*…\w*|\.\.\.)"
SHAPE = re.compile(rf"\bshapes?\b|\({_AXIS}(?:, {_AXIS})+\)|\({_AXIS},\)|\(…\)|\(\.\.\.\)")

NUMBER = re.compile(r"\b(float|Floats|ArrayLike|Array)\b")
QUANTITY = re.compile(
    r"(?i)(?<![^\W_])(times?|timesteps?|timeouts?|durations?|delays?|seconds|distances?|lengths?|heights?|radius|radii"
    r"|angles?|yaw|rpy|pos|positions?|poses?|velocit(?:y|ies)|speeds?|accelerations?|forces?|torques?|wrench(?:es)?"
    r"|efforts?|mass(?:es)?|inertias?|frequenc(?:y|ies)|gravity|stiffness|damping)(?![^\W_])"
)
"""Physical quantities. An underscore separates words."""
_SYMBOL = r"(?:1/)?(?:m|mm|s|ms|min|rad|deg|°|N|kg|Hz|px|pixels?|inches|steps|control steps|B|GB|GiB|MiB)[²³]?"
UNIT = re.compile(rf"\[{_SYMBOL}(?:(?:[·/]| or |, ){_SYMBOL})*\]|\bunits?\b")
NO_UNIT = re.compile(
    r"(?i)(?<![^\W_])(rates?|ratios?|fraction|share|factors?|multiplier|weight|probability|number of|per.second"
    r"|quaternions?|quat_wxyz|of length 1|unit vectors?|directions?)(?![^\W_])"
)
"""Words for numbers that have no unit."""

REFERENCE = re.compile(
    r"\b(?:arguments?|errors)\b[^.`]*:\w+:`[~.]*([\w.]+)`|:\w+:`[~.]*([\w.]+)` for (?:the )?(?:arguments|errors)\b"
)
"""Sentences that refer to the arguments or errors of another function."""


@dataclass(frozen=True)
class Documented:
    """A public function, method, property or constructor, and the class to which it belongs."""

    name: str
    function: Callable[..., Any]
    owner: type | None = None

    @cached_property
    def documents(self) -> list[str]:
        """The docstring, the inherited docstrings, and those to which these refer."""
        key = self.function.__name__
        found: list[Any] = [self.function]
        if self.owner:
            parents = self.owner.__mro__[:-1]
            found += parents if key == "__init__" else (function_of(vars(cls).get(key)) for cls in parents[1:])
        texts = [inspect.cleandoc(value.__doc__) for value in found if value and value.__doc__]
        scopes = ["", f"{self.function.__module__}."]
        scopes += [f"{self.owner.__module__}.{self.owner.__qualname__}."] if self.owner else []
        for match in REFERENCE.finditer("\n".join(texts)):
            targets = (pydoc.locate(scope + (match[1] or match[2])) for scope in scopes)
            texts += [inspect.getdoc(target) or "" for target in targets if target]
        return texts

    def complaints(self) -> Iterator[str]:
        """Yield what the docstrings do not describe."""
        document = "\n\n".join(self.documents)
        described = entries(document)
        signature = inspect.signature(self.function)
        for name, parameter in signature.parameters.items():
            if name in ("self", "cls") or name.startswith("_") or parameter.kind is parameter.VAR_KEYWORD:
                continue
            kind, text = str(parameter.annotation), described.get(name, document)
            if NEEDS_WORDS.search(kind) and not re.search(rf"(?i)\b{name}\b", document):
                yield f"{name}: not named"
            elif lacks_shape(kind, text):
                yield f"{name}: no shape"
            elif lacks_unit(kind, f"{name} {described.get(name, '')}", f"{name} {text}"):
                yield f"{name}: no unit"
        kind, results = str(signature.return_annotation), [*map(result, self.documents), ""]
        if lacks_shape(kind, " ".join(results)):
            yield "result: no shape"
        elif lacks_unit(kind, results[0], " ".join(results)):
            yield "result: no unit"
        promised = document + str(self.owner and self.owner.__doc__)
        body = ast.parse(textwrap.dedent(inspect.getsource(self.function))).body
        for error in sorted(set(raised(ast.iter_child_nodes(body[0])))):
            cls = self.function.__globals__.get(error, getattr(builtins, error, None))
            names = [parent.__name__ for parent in cls.__mro__[:-3]] if cls else [error]  # not Exception and above
            if not re.search(rf"\b({'|'.join(names)})\b", promised):
                yield f"{error}: not named"


def entries(document: str) -> dict[str, str]:
    """Return the descriptions in the sections ``Args:`` and ``Attributes:``, by name."""
    found: dict[str, str] = {}
    inside, name = False, ""
    for line in document.splitlines():
        entry = re.match(r"    (\w+)(?: \(.*?\))?:(.*)", line)
        if line.strip() and not line.startswith(" "):
            inside, name = line in ("Args:", "Attributes:"), ""
        elif inside and entry:
            name = entry[1]
            found[name] = found.get(name, "") + entry[2]
        elif inside and name:
            found[name] += f" {line.strip()}"
    return found


def result(document: str) -> str:
    """Return the description of a function's result: the first paragraph and the section ``Returns:``."""
    section = re.search(r"^(Returns|Yields):\n((?:    .*\n|\n)+)", f"{document}\n", re.MULTILINE)
    return document.partition("\n\n")[0] + (f"\n{section[2]}" if section else "")


def lacks_shape(kind: str, text: str) -> bool:
    """Return whether a type is an array's, and the text does not contain a shape."""
    return bool(ARRAY.search(NO_ARRAY.sub("", kind))) and not SHAPE.search(text)


def lacks_unit(kind: str, quantity: str, text: str) -> bool:
    """Return whether a number is a physical quantity, and the text has neither a unit nor a word for having none."""
    return bool(NUMBER.search(kind) and QUANTITY.search(quantity)) and not (UNIT.search(text) or NO_UNIT.search(text))


def raised(nodes: Iterable[ast.AST], caught: str = "") -> Iterator[str]:
    """Yield the names of the error classes that a function raises itself and does not catch."""
    for node in nodes:
        if isinstance(node, ast.Raise) and node.exc:
            call = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            for name in re.findall(r"\b\w+Error\b", ast.unparse(call)):
                if name not in caught and name not in ("NotImplementedError", "AssertionError"):
                    yield name
        elif isinstance(node, ast.Try):
            handled = " ".join(ast.unparse(handler.type) for handler in node.handlers if handler.type)
            yield from raised(node.body, f"{caught} {handled}")
            yield from raised([*node.handlers, *node.orelse, *node.finalbody], caught)
        elif not isinstance(node, ast.FunctionDef | ast.Lambda):
            yield from raised(ast.iter_child_nodes(node), caught)


def function_of(member: object) -> Any:
    """Return the function of a method or property, or None for other members of a class."""
    places = (getattr(member, place, None) for place in ("fget", "func", "__func__"))
    return next(filter(inspect.isfunction, (*places, member)), None)


def members(module: str) -> Iterator[tuple[str, Any]]:
    """Yield the public functions and classes of a module by name."""
    values = vars(import_module(module))
    for name in values.get("__all__", [name for name in values if not name.startswith("_")]):
        value = getattr(import_module(module), name)
        home = str(getattr(value, "__module__", ""))
        if home.startswith("frobs") and ("__all__" in values or home == module):
            yield name, value


def functions(module: str) -> Iterator[Documented]:
    """Yield the public functions of a module, and the methods, properties and constructors of its classes."""
    for name, value in members(module):
        if inspect.isfunction(value):
            yield Documented(f"{module}.{name}", value)
        elif inspect.isclass(value):
            for key, member in vars(value).items():
                function = function_of(member)
                public = not key.startswith("_") or (key == "__init__" and not is_dataclass(value))
                if function and public and function.__module__.startswith("frobs"):
                    yield Documented(f"{module}.{name}.{key}", function, value)


def attributes(cls: type) -> Iterator[str]:
    """Yield the attributes of a class whose description lacks a unit."""
    described = entries(inspect.cleandoc(cls.__doc__ or ""))
    for name, kind in vars(cls).get("__annotations__", {}).items():
        text = f"{name} {described.get(name, '')}"
        if name in described and lacks_unit(str(kind), text, text):
            yield f"{cls.__name__}.{name}: no unit"


def complaints(module: str) -> list[str]:
    """Return everything that the docstrings of a module do not describe."""
    found = [f"{each.name}: {complaint}" for each in functions(module) for complaint in each.complaints()]
    classes = [value for _, value in members(module) if inspect.isclass(value)]
    return found + [f"{module}.{complaint}" for cls in classes for complaint in attributes(cls)]


@pytest.mark.parametrize("module", MODULES)
def test_docstrings_describe_arguments_shapes_units_and_errors(module: str) -> None:
    found = complaints(module)
    assert not found, "\n".join(found)


def test_all_kinds_of_members_are_checked() -> None:
    contracts = {each.name.removeprefix("frobs_core.contracts.") for each in functions("frobs_core.contracts")}
    assert {"distance_between", "Simulation.step", "Simulation.time", "Simulation.translation"} <= contracts
    assert "Algorithm.__init__" in contracts
    names = {each.name for module in MODULES for each in functions(module)}
    assert "frobs_core.description.Robot.lidars" in names  # a cached property
    assert "frobs_train.Run.open" in names  # imported when it is first used
    assert len(names) > 600


def undocumented_methods(text: str, inherited: Mapping[str, set[str]]) -> list[str]:
    """Return the public methods of public classes that neither have a docstring nor inherit one."""
    found = []
    for cls in ast.parse(text).body:
        if isinstance(cls, ast.ClassDef) and not cls.name.startswith("_"):
            for node in cls.body:
                if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and not ast.get_docstring(node):
                    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
                    added = any(name.endswith((".setter", "overload")) for name in decorators)
                    if not added and node.name not in inherited.get(cls.name, ()):
                        found.append(f"{cls.name}.{node.name}")
    return found


def documented_by_bases(texts: Iterable[str]) -> dict[str, set[str]]:
    """Return the methods that the bases of each class document, by the class's name."""
    classes = [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ClassDef)]
    own: dict[str, set[str]] = {}
    bases: dict[str, set[str]] = {}
    for cls in classes:
        functions = [node for node in cls.body if isinstance(node, ast.FunctionDef)]
        own.setdefault(cls.name, set()).update(node.name for node in functions if ast.get_docstring(node))
        names = (re.sub(r"\[.*", "", ast.unparse(base)).rpartition(".")[2] for base in cls.bases)
        bases.setdefault(cls.name, set()).update(name for name in names if name != cls.name)

    def above(name: str) -> set[str]:
        parents = bases.get(name, set())
        return parents.union(*map(above, parents))

    return {name: set().union(*(own.get(base, set()) for base in above(name))) for name in bases}


def test_methods_have_or_inherit_a_docstring() -> None:
    folders = [ROOT / name for name in ("frobs_core", "templates", "examples", "docs", ".ci")]
    paths = [path for folder in (*folders, *ROOT.glob("plugins/*/src")) for path in folder.rglob("*.py")]
    texts = {path: path.read_text("utf-8") for path in paths}
    inherited = documented_by_bases(texts.values())
    found = {path: names for path, text in texts.items() if (names := undocumented_methods(text, inherited))}
    assert len(paths) > 800
    assert not found, "\n".join(f"{path}: {', '.join(names)}" for path, names in found.items())


def test_methods_without_a_docstring_are_found() -> None:
    text = '''
class Arm(ABC):
    def move(self):
        """Move."""
class Fast(kit.Arm[int]):
    def move(self): ...
    def stop(self): ...
    def _aim(self): ...
'''
    assert undocumented_methods(text, documented_by_bases([text])) == ["Fast.stop"]


# Each of the following functions breaks one rule.


def unnamed_parameter(threshold: int) -> None:
    """Compare."""


def parameter_without_shape(offsets: Floats) -> None:
    """Add the ``offsets`` (if there are any)."""


def entry_without_shape(first: Floats, second: Floats) -> None:
    """Add arrays.

    Args:
        first: (n, 3)
        second: The other array.
    """


def result_without_shape() -> Floats:
    """Return the offsets."""
    return np.zeros(3)


def parameter_without_unit(start: float, limits: tuple[float, float]) -> None:
    """Wait.

    Args:
        start: Time at which to begin, in [0, 1].
        limits: Shortest and longest duration [s].
    """


def named_quantity_without_unit(joint_position: float) -> None:
    """Go to ``joint_position``."""


def result_without_unit(start: float) -> float:
    """Return the distance to the ``start``."""
    return start


def unnamed_error(path: str) -> None:
    """Read an object from a ``path``.

    Raises:
        OSError: It cannot be read.
    """
    try:
        raise OSError
    except ValueError:
        raise ParameterValueError("path", path, "not empty") from None


def everything(
    name: str, limits: Floats, mask: Mask, state: Mapping[str, np.ndarray[Any, Any]], share: float
) -> Floats:
    """Move the robot called ``name`` to the position of its ``state`` in the environments selected by ``mask``.

    Args:
        limits: Velocities that the joints of the robot must not exceed, in the order of the joints,
            (num_envs, dof) [rad/s].
        share: Fraction of the time.

    Returns:
        The positions, (…, dof) [rad or m].

    Raises:
        ConfigurationError: Something is wrong.
    """

    def check() -> None:
        raise RuntimeError

    try:
        raise ValueError
    except ValueError:
        raise ParameterValueError(name, limits, "finite") from None


def snapshot(state: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    """Return the ``state``."""
    return dict(state)


def referring(name: str, limits: Floats) -> None:
    """Move. For the other arguments and the errors, see :func:`everything`."""
    raise ConfigurationError


class Parent:
    """A base class.

    Args:
        duration: Time [s].

    Attributes:
        height: Above the floor.
        radius: [m]
        mass_factor: Multiplies the mass.
    """

    height: float
    radius: float
    mass_factor: float

    def __init__(self, duration: float) -> None:
        raise ParameterValueError("duration", duration, "positive")

    def move(self, target: str) -> float:
        """Return the distance to the ``target`` [m]."""
        return len(target)


class Child(Parent):
    """Raises ParameterValueError if the robot is not on."""

    def __init__(self, duration: float) -> None:
        super().__init__(duration)

    def move(self, target: str) -> float:
        """Return the distance, or raise an error."""
        raise ParameterValueError("on", False, "true")


@pytest.mark.parametrize(
    ("function", "owner", "expected"),
    [
        (unnamed_parameter, None, ["threshold: not named"]),
        (parameter_without_shape, None, ["offsets: no shape"]),
        (entry_without_shape, None, ["second: no shape"]),
        (result_without_shape, None, ["result: no shape"]),
        (parameter_without_unit, None, ["start: no unit"]),
        (named_quantity_without_unit, None, ["joint_position: no unit"]),
        (result_without_unit, None, ["result: no unit"]),
        (unnamed_error, None, ["ParameterValueError: not named"]),
        (everything, None, []),
        (snapshot, None, []),
        (referring, None, []),
        (Parent.__init__, Parent, ["ParameterValueError: not named"]),
        (Parent.move, Parent, []),
        (Child.__init__, Child, []),
        (Child.move, Child, []),
    ],
)
def test_missing_facts_are_found(function: Callable[..., Any], owner: type | None, expected: list[str]) -> None:
    assert list(Documented("", function, owner).complaints()) == expected


def test_attributes_without_unit_are_found() -> None:
    assert list(attributes(Parent)) == ["Parent.height: no unit"]

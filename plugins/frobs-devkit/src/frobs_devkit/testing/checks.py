"""Definition of a check: a name, a rule, and a function that raises an exception if the rule is violated."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any, TypeVar

from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.util.errors import FrobsError
from frobs_core.util.keywords import constructor_parameters


class CheckFailure(FrobsError, AssertionError):  # noqa: N818 - pytest also calls this outcome a failure
    """A check failed. The message describes what the check expected and what it found."""


class Inconclusive(Exception):  # noqa: N818 - not an error
    """The tested situation did not occur during the check. For example, no episode ended or no joint moved."""


class NotApplicable(Exception):  # noqa: N818 - not an error
    """The check does not apply, because the checked object does not claim the tested feature."""


@dataclass(frozen=True)
class Check:
    """One check of the conformance kit.

    Attributes:
        name: Name in lowercase with underscores, unique within a list of checks.
        description: The rule in one sentence.
        run: Function that runs the check. The function may raise :class:`CheckFailure`, :class:`Inconclusive`,
            :class:`NotApplicable`, or any exception that the checked object raises.
        capability: Simulator capability that the check verifies, or ``""``.
        requires: Names of the required checks. If a required check fails, this check is skipped.
    """

    name: str
    description: str
    run: Callable[[], None]
    capability: str = ""
    requires: tuple[str, ...] = ()

    def under(self, prefix: str) -> Check:
        """Return a copy of the check in which the prefix and a dot precede its name and the names in ``requires``."""
        requires = tuple(f"{prefix}.{name}" for name in self.requires)
        return replace(self, name=f"{prefix}.{self.name}", requires=requires)


Function = TypeVar("Function", bound=Callable[[Any], None])


def after(*names: str) -> Callable[[Function], Function]:
    """Return a decorator that marks a check to be skipped if one of the named checks has failed."""

    def decorate(function: Function) -> Function:
        function.requires = names  # type: ignore[attr-defined]
        return function

    return decorate


def checks_of(*modules: ModuleType) -> tuple[Callable[[Any], None], ...]:
    """Return the modules' public functions whose only parameter is named ``subject``, in source order."""
    return tuple(
        function
        for module in modules
        for name, function in vars(module).items()
        if inspect.isfunction(function)
        and function.__module__ == module.__name__
        and not name.startswith("_")
        and list(inspect.signature(function).parameters) == ["subject"]
    )


def checks_in(package: str, modules: str) -> tuple[Callable[[Any], None], ...]:
    """Return the checks of a package's modules, whose names are separated by spaces."""
    return checks_of(*(import_module(f"{package}.{name}") for name in modules.split()))


def collect(subject: Any, functions: Iterable[Callable[[Any], None]]) -> list[Check]:
    """Create a check from each function, using the function's name and the first line of its docstring."""
    return [
        Check(
            name=function.__name__,
            description=(inspect.getdoc(function) or "").partition("\n")[0],
            run=partial(function, subject),
            capability=getattr(function, "capability", ""),
            requires=getattr(function, "requires", ()),
        )
        for function in functions
    ]


def expect(condition: object, message: str) -> None:
    """Raise CheckFailure with ``message`` if ``condition`` is false."""
    if not condition:
        raise CheckFailure(message)


def only(name: str, description: str, outcome: Inconclusive | NotApplicable) -> list[Check]:
    """Return a single check that raises ``outcome``, for an object that cannot be checked further."""

    def run() -> None:
        raise outcome

    return [Check(name, description, run)]


def expect_capability(name: str) -> None:
    """Raise CheckFailure unless a name in a record's ``needs`` is a capability."""
    known = name in known_capabilities()
    expect(known, f"the record's 'needs' contains '{name}', which is not a capability.")


def expect_keyword_only(cls: type) -> None:
    """Raise CheckFailure unless all constructor parameters of a class are keyword-only and have defaults."""
    for name, parameter in constructor_parameters(cls).items():
        expect(
            parameter.kind is inspect.Parameter.KEYWORD_ONLY and parameter.default is not inspect.Parameter.empty,
            f"the constructor's parameter '{name}' must be keyword-only and have a default, because users may pass it "
            "by name or omit it.",
        )


@contextmanager
def second_close() -> Iterator[None]:
    """Raise CheckFailure if the ``with`` block, in which an object is closed a second time, raises an error."""
    try:
        yield
    except Exception as error:
        raise CheckFailure(
            f"calling close() a second time raises {type(error).__name__}: {error}; the second call must have no "
            "effect."
        ) from error


@contextmanager
def expect_raises(kind: type[Exception] | tuple[type[Exception], ...], what: str, naming: str = "") -> Iterator[None]:
    """Raise CheckFailure unless the ``with`` block raises a certain error, whose message contains ``naming``.

    The failure message begins with ``what``, the operation that must raise.
    """
    name = (kind if isinstance(kind, type) else kind[0]).__name__
    try:
        yield
    except kind as error:
        expect(naming in str(error), f"the error message of {what} does not contain '{naming}': {error}")
        return
    except Exception as error:
        raise CheckFailure(f"{what} raises {type(error).__name__} ({error}), not {name}.") from error
    raise CheckFailure(f"{what} does not raise an error; it must raise {name}.")

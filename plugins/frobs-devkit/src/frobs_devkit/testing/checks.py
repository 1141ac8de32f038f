"""A check: a name, a rule, and a function that returns if the rule holds and raises otherwise."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any, TypeVar

from frobs_core.errors import FrobsError
from frobs_core.keywords import constructor_parameters


class CheckFailure(FrobsError, AssertionError):  # noqa: N818 - pytest's word, and what an author sees
    """A check failed. The message contains the expectation, the finding and the rule."""


class Inconclusive(Exception):  # noqa: N818 - an outcome, not an error
    """The check ran but nothing happened that could have failed: no episode ended, or nothing moved."""


class NotApplicable(Exception):  # noqa: N818 - an outcome, not an error
    """The check does not apply, because the subject does not claim the feature."""


@dataclass(frozen=True)
class Check:
    """One check of the conformance kit.

    Attributes:
        name: Lowercase with underscores; unique in its list.
        description: The rule in one sentence.
        run: Runs the check; raises :class:`CheckFailure`, :class:`Inconclusive`, :class:`NotApplicable`, or any
            exception of the subject.
        capability: Capability of the simulator that it verifies, or ``""``.
        requires: Names of checks that must pass first. If one of them fails, this one is skipped.
    """

    name: str
    description: str
    run: Callable[[], None]
    capability: str = ""
    requires: tuple[str, ...] = ()

    def under(self, prefix: str) -> Check:
        """Return the check with a prefix and a dot before its name and before the names of required checks."""
        requires = tuple(f"{prefix}.{name}" for name in self.requires)
        return replace(self, name=f"{prefix}.{self.name}", requires=requires)


Function = TypeVar("Function", bound=Callable[[Any], None])


def after(*names: str) -> Callable[[Function], Function]:
    """Mark a check as meaningless if one of the named checks has failed."""

    def decorate(function: Function) -> Function:
        function.requires = names  # type: ignore[attr-defined]
        return function

    return decorate


def checks_of(*modules: ModuleType) -> tuple[Callable[[Any], None], ...]:
    """Return the checks of modules: their public functions with a single parameter ``subject``, in source order."""
    return tuple(
        function
        for module in modules
        for name, function in vars(module).items()
        if inspect.isfunction(function)
        and function.__module__ == module.__name__
        and not name.startswith("_")
        and list(inspect.signature(function).parameters) == ["subject"]
    )


def collect(subject: Any, functions: Iterable[Callable[[Any], None]]) -> list[Check]:
    """Create checks from functions of one argument, named after them and described by their docstring's first line."""
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
    """Raise CheckFailure with ``message`` unless ``condition`` is true."""
    if not condition:
        raise CheckFailure(message)


def only(name: str, description: str, outcome: Inconclusive | NotApplicable) -> list[Check]:
    """Return the only check of a subject that cannot be checked further; it raises the outcome."""

    def run() -> None:
        raise outcome

    return [Check(name, description, run)]


def expect_keyword_only(cls: type) -> None:
    """Raise CheckFailure unless a constructor takes keyword-only parameters with defaults."""
    for name, parameter in constructor_parameters(cls).items():
        expect(
            parameter.kind is inspect.Parameter.KEYWORD_ONLY and parameter.default is not inspect.Parameter.empty,
            f"the constructor's parameter '{name}' is not keyword-only with a default, but users may only pass it by "
            "name or omit it.",
        )


@contextmanager
def expect_raises(wanted: type[Exception] | tuple[type[Exception], ...], what: str, naming: str = "") -> Iterator[None]:
    """Raise CheckFailure unless the ``with`` block raises ``wanted``.

    Args:
        wanted: The expected error, or alternatives.
        what: Beginning of the message: what should raise it.
        naming: Text that the error's message must contain.
    """
    name = (wanted if isinstance(wanted, type) else wanted[0]).__name__
    try:
        yield
    except wanted as error:
        expect(naming in str(error), f"the error of {what} does not contain '{naming}': {error}")
        return
    except Exception as error:
        raise CheckFailure(f"{what} raises {type(error).__name__} ({error}), not {name}.") from error
    raise CheckFailure(f"{what} does not raise an error; it must raise {name}.")

"""What a check is: a name, a rule, and a function that returns if the rule holds and raises if not."""

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
    """A check did not hold; the message says what was expected, what there was, and what the rule is."""


class Inconclusive(Exception):  # noqa: N818 - an outcome, not an error
    """The check ran and saw nothing that could have failed: no episode ended, nothing moved, a package is missing."""


class NotApplicable(Exception):  # noqa: N818 - an outcome, not an error
    """The check is about something that the subject does not claim to have."""


@dataclass(frozen=True)
class Check:
    """One check of the conformance kit.

    Attributes:
        name: Lower case with underscores; unique in its list.
        description: One sentence: the rule.
        run: Does it; raises :class:`CheckFailure`, :class:`Inconclusive`, :class:`NotApplicable`, or whatever the
            subject raises.
        capability: The simulator's capability that it verifies, or ``""``.
        requires: Names of checks without which this one means nothing: if one of them failed, it is skipped.
    """

    name: str
    description: str
    run: Callable[[], None]
    capability: str = ""
    requires: tuple[str, ...] = ()

    def under(self, prefix: str) -> Check:
        """Return the check with a prefix and a dot before its name, and before those that it requires."""
        requires = tuple(f"{prefix}.{name}" for name in self.requires)
        return replace(self, name=f"{prefix}.{self.name}", requires=requires)


Function = TypeVar("Function", bound=Callable[[Any], None])


def after(*names: str) -> Callable[[Function], Function]:
    """Mark a check that means nothing if one of the checks with these names has failed."""

    def decorate(function: Function) -> Function:
        function.requires = names  # type: ignore[attr-defined]
        return function

    return decorate


def checks_of(*modules: ModuleType) -> tuple[Callable[[Any], None], ...]:
    """Return the checks of modules: their public functions of one parameter, ``subject``, as they are ordered there."""
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
    """Make checks of functions of one argument: the name is the function's, the description its docstring's first line."""
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
    """Return the only check of a subject that nothing can be checked of: it raises why."""

    def run() -> None:
        raise outcome

    return [Check(name, description, run)]


def expect_keyword_only(cls: type) -> None:
    """Raise CheckFailure unless a constructor takes keyword-only parameters, each with a default."""
    for name, parameter in constructor_parameters(cls).items():
        expect(
            parameter.kind is inspect.Parameter.KEYWORD_ONLY and parameter.default is not inspect.Parameter.empty,
            f"the constructor's parameter '{name}' is not keyword-only with a default; users give it by name or not at all.",
        )


@contextmanager
def expect_raises(wanted: type[Exception] | tuple[type[Exception], ...], what: str, naming: str = "") -> Iterator[None]:
    """Raise CheckFailure unless the ``with`` block raises ``wanted``.

    Args:
        wanted: The error, or several of which one is enough.
        what: How the message begins: what should raise it.
        naming: What the error's own message must contain.
    """
    name = (wanted if isinstance(wanted, type) else wanted[0]).__name__
    try:
        yield
    except wanted as error:
        expect(naming in str(error), f"the error of {what} does not name '{naming}': {error}")
        return
    except Exception as error:
        raise CheckFailure(f"{what} raises {type(error).__name__} ({error}), not {name}.") from error
    raise CheckFailure(f"{what} passes; it must raise {name}.")

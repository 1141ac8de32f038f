"""Import and build wrappers and callbacks from their names (``"package.module:Name"``) and keyword arguments."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import gymnasium as gym

from frobs_core.util.errors import ConfigurationError, FrobsError, UnknownParameterError, nearest
from frobs_core.util.validation import located
from frobs_train.errors import ComponentError

if TYPE_CHECKING:
    from frobs_train.configuration.config import ComponentConfig


def load_component(name: str, what: str) -> Any:
    """Import a wrapper or callback by its name, ``"package.module:Name"``. Error messages call it ``what``."""
    module_name, _, attribute = name.partition(":")
    if not module_name or not attribute:
        raise ComponentError(what, name, "is not of the form package.module:Name.")
    try:
        module = import_module(module_name)
    except Exception as error:
        raise ComponentError(
            what, name, f"cannot be imported from '{module_name}': {type(error).__name__}: {error}."
        ) from error
    try:
        return getattr(module, attribute)
    except AttributeError:
        similar = nearest(attribute, dir(module))
        hint = f" Did you mean '{similar}'?" if similar else ""
        raise ComponentError(
            what, name, f"does not exist: module '{module_name}' has no '{attribute}'.{hint}"
        ) from None


def load_wrapper(component: ComponentConfig) -> type[Any]:
    """Import a wrapper class, and check that it is a Gymnasium wrapper."""
    wrapper = load_component(component.name, "wrapper")
    if not (isinstance(wrapper, type) and issubclass(wrapper, (gym.Wrapper, gym.vector.VectorWrapper))):
        raise ComponentError(
            "wrapper", component.name, "is neither a gymnasium.Wrapper nor a gymnasium.vector.VectorWrapper."
        )
    return wrapper


def check_components(components: Sequence[ComponentConfig], written: Any, what: str) -> None:
    """Import wrappers or callbacks, and check their keyword arguments without building them.

    Error messages contain the file and line of the ``written``, unvalidated settings.
    """
    for index, component in enumerate(components):
        key = "name"
        try:
            item = load_wrapper(component) if what == "wrapper" else load_component(component.name, what)
            taken = _keywords(item, without_first=what == "wrapper")
            for key in component.kwargs:
                if taken is not None and key not in taken:
                    raise UnknownParameterError(f"{what} '{component.name}'", key, taken)
        except ConfigurationError as error:
            raise located(error, {f"{what}s": written}, [f"{what}s", index, key]) from None


def build_component(factory: Any, args: Sequence[Any], component: ComponentConfig, what: str) -> Any:
    """Build a component by calling its factory, and convert exceptions to ComponentError."""
    try:
        return factory(*args, **component.kwargs)
    except FrobsError:
        raise
    except Exception as error:
        given = ", ".join(f"{key}={value!r}" for key, value in component.kwargs.items())
        raise ComponentError(
            what, component.name, f"cannot be built{f' with {given}' if given else ''}: {type(error).__name__}: {error}"
        ) from error


def _keywords(factory: Any, without_first: bool) -> list[str] | None:
    """Return the argument names that a factory accepts, or None if it accepts any name or has no signature."""
    try:
        parameters: Mapping[str, inspect.Parameter] = inspect.signature(factory).parameters
    except (TypeError, ValueError):
        return None
    if any(parameter.kind is inspect.Parameter.VAR_KEYWORD for parameter in parameters.values()):
        return None
    return list(parameters)[1 if without_first else 0 :]

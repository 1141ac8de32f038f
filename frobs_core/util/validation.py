"""Validation of mappings with pydantic models, and of single values.

The functions for single values return the value, or raise a :class:`~frobs_core.util.errors.ParameterValueError` that
contains the name of the parameter, the value and the rule.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeVar, cast, get_args

import numpy as np

from frobs_core.util.arrays import Floats
from frobs_core.util.errors import (
    ConfigFileError,
    ConfigurationError,
    MissingSettingError,
    ParameterValueError,
    UnknownParameterError,
    check_keys,
    nearest,
)
from frobs_core.util.yaml import find_origin

if TYPE_CHECKING:
    from pydantic import BaseModel

Model = TypeVar("Model", bound="BaseModel")


def validate(model: type[Model], settings: Mapping[str, Any], owner: str) -> Model:
    """Validate settings and return them as a model.

    Args:
        model: A pydantic model that forbids extra keys.
        settings: Settings to validate. For a :class:`frobs_core.util.yaml.ConfigMapping`, errors contain the file and
            line.
        owner: Object that the settings configure, such as ``"algorithm 'ppo'"``.

    Returns:
        The model.

    Raises:
        UnknownParameterError: A key is unknown.
        ConfigurationError: A value is invalid.
        ConfigFileError: A key that was read from a file is unknown, or its value is invalid.
    """
    from pydantic import ValidationError

    try:
        return model.model_validate(settings)
    except ValidationError as failure:
        problem = min(failure.errors(), key=lambda item: item["type"] != "extra_forbidden")
        keys = problem["loc"]
        if problem["type"] == "extra_forbidden":
            holder = ".".join(str(key) for key in keys[:-1])
            error: ConfigurationError = UnknownParameterError(
                f"'{holder}' of {owner}" if holder else owner, str(keys[-1]), _fields(model, keys[:-1])
            )
        else:
            error = _explain(owner, ".".join(_present(settings, keys)), problem)
        raise located(error, settings, keys) from None


def located(error: ConfigurationError, settings: Mapping[str, Any], keys: Iterable[str | int]) -> ConfigurationError:
    """Return an error that names the file and line of a setting, or the error itself if no file contains the setting.

    Args:
        error: The error. A :class:`~frobs_core.util.errors.ConfigFileError` is returned unchanged.
        settings: Settings, such as a :class:`frobs_core.util.yaml.ConfigMapping`.
        keys: Keys of the setting, from the outermost to the innermost.
    """
    origin = None if isinstance(error, ConfigFileError) else find_origin(settings, keys)
    return error if origin is None else ConfigFileError(*origin, str(error))


def plain_settings(settings: BaseModel | Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as a dictionary of YAML-serializable values."""
    return dict(settings) if isinstance(settings, Mapping) else settings.model_dump(mode="json")


def _explain(owner: str, name: str, problem: Mapping[str, Any]) -> ConfigurationError:
    message, value = problem["msg"].removeprefix("Value error, "), problem["input"]
    if problem["type"] == "missing":
        return MissingSettingError(owner, name)
    if not name:  # the rule is about several settings
        return ConfigurationError(f"{owner}: {message}.")
    if message.startswith("Input should be "):
        return ParameterValueError(name, value, message.removeprefix("Input should be "), owner)
    return ConfigurationError(f"{owner}: {name} = {value!r}: {message}.")


_RULES: Mapping[str, tuple[Any, str]] = {
    "str | None": (str | None, "a name or None"),
    "float | None": (Real | None, "a number of seconds or None"),
    "Mapping": (Mapping, "a mapping"),
    "Mapping | None": (Mapping | None, "a mapping or None"),
}
"""Types of the attributes with an annotation, without what is in brackets, and descriptions of the valid values."""


def check_types(config: Any, **others: tuple[Any, str]) -> None:
    """Check the attributes of a dataclass that are annotated as a mapping, an optional name or an optional time.

    The keys of mappings must be strings. If a mapping is not optional, an empty mapping replaces None.

    Args:
        config: The dataclass, which may be frozen. Its annotations are strings, as in a module that postpones them.
        others: Types of other attributes by name, each with a description of the valid values.

    Raises:
        ParameterValueError: An attribute has another type, or is a boolean.
    """
    annotations = {item.name: re.sub(r"\[[^]]*\]", "", str(item.type)) for item in fields(config)}
    rules = {name: _RULES[annotation] for name, annotation in annotations.items() if annotation in _RULES}
    for name, (types, rule) in {**rules, **others}.items():
        value = getattr(config, name)
        if value is None and types is Mapping:
            object.__setattr__(config, name, {})
        elif not isinstance(value, types) or isinstance(value, bool):
            raise ParameterValueError(name, value, rule)
        elif isinstance(value, Mapping) and not all(isinstance(key, str) for key in value):
            raise ParameterValueError(name, value, "a mapping whose keys are strings")


def check_fields(owner: str, cls: type[Any], settings: Mapping[str, Any]) -> None:
    """Check that the settings of ``owner`` contain only fields of a dataclass, and every field without a default.

    Raises:
        UnknownParameterError: There is no field with a given name.
        MissingSettingError: A field without a default is missing.
    """
    check_keys(owner, settings, [item.name for item in fields(cls)])
    required = [item.name for item in fields(cls) if item.default is MISSING and item.default_factory is MISSING]
    if missing := [name for name in required if name not in settings]:
        raise MissingSettingError(owner, ", ".join(missing))


def finite(name: str, value: Any, unit: str = "") -> float:
    """Return a finite number.

    Args:
        name: Name of the parameter.
        value: Value of the parameter.
        unit: Unit of the parameter.

    Raises:
        ParameterValueError: The value does not meet the condition.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise ParameterValueError(name, value, f"a finite number{unit and f' [{unit}]'}")
    return float(value)


def positive(name: str, value: Any, unit: str = "") -> float:
    """Return a finite number above 0. For the arguments and errors, see :func:`finite`."""
    if finite(name, value, unit) <= 0.0:
        raise ParameterValueError(name, value, f"above 0{unit and f' [{unit}]'}")
    return float(value)


def non_negative(name: str, value: Any, unit: str = "") -> float:
    """Return a finite number of at least 0. For the arguments and errors, see :func:`finite`."""
    if finite(name, value, unit) < 0.0:
        raise ParameterValueError(name, value, f"0 or more{unit and f' [{unit}]'}")
    return float(value)


def whole_number(name: str, value: Any, lowest: int = 0, highest: int | None = None) -> int:
    """Return a whole number in [lowest, highest]. For the other arguments and errors, see :func:`finite`."""
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not is_whole or value < lowest or (highest is not None and value > highest):
        limits = f"of at least {lowest}" if highest is None else f"from {lowest} to {highest:,}"
        raise ParameterValueError(name, value, f"a whole number {limits}")
    return int(value)


def choice(name: str, value: Any, choices: Iterable[str]) -> str:
    """Return a value that is one of ``choices``. For the other arguments and errors, see :func:`finite`."""
    known = list(choices)
    if value not in known:
        close = nearest(str(value), known)
        hint = f" (did you mean '{close}'?)" if close else ""
        raise ParameterValueError(name, value, f"one of {', '.join(map(repr, known))}{hint}")
    return str(value)


def boolean(name: str, value: Any) -> bool:
    """Return True or False. For the arguments and errors, see :func:`finite`."""
    if not isinstance(value, bool | np.bool_):
        raise ParameterValueError(name, value, "true or false")
    return bool(value)


def number_list(name: str, value: Any, count: int | None = None) -> tuple[float, ...]:
    """Return a list of ``count`` finite numbers, or, if ``count`` is None, of at least one.

    For the other arguments and errors, see :func:`finite`.
    """
    given = list(value) if isinstance(value, Iterable) and not isinstance(value, str | bytes | dict) else []
    if not given or count not in (None, len(given)):
        raise ParameterValueError(name, value, "a list of numbers" if count is None else f"{count} numbers")
    return tuple(finite(f"{name}[{i}]", number) for i, number in enumerate(given))


def image_size(name: str, value: Any, longest: int) -> tuple[int, int]:
    """Return the size of an image, (height, width) [pixels], whose sides are whole numbers in [1, longest].

    For the other arguments and errors, see :func:`finite`.
    """
    sides = tuple(value) if isinstance(value, Iterable) else ()
    if len(sides) != 2 or not all(isinstance(side, int | np.integer) and 0 < side <= longest for side in sides):
        raise ParameterValueError(name, value, f"(height, width) in pixels, up to {longest:,}")
    return sides


def numbers(vector: Floats) -> str:
    """Format a vector, (n,), for messages: ``(0.5, -0.25, 1)``."""
    return "(" + ", ".join(f"{number:.4g}" for number in vector) + ")"


def _fields(model: type[BaseModel], keys: tuple[int | str, ...]) -> list[str]:
    """Return the keys that the model accepts at a nested level."""
    for key in keys:
        if key not in model.model_fields:  # added by pydantic for the members of a union
            continue
        inner = _model_in(model.model_fields[str(key)].annotation)
        if inner is None:
            return []
        model = inner
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the first pydantic model in a type annotation, including its arguments, or None."""
    from pydantic import BaseModel

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for part in get_args(annotation) if (found := _model_in(part)) is not None), None)


def _present(settings: object, keys: tuple[int | str, ...]) -> list[str]:
    """Return the key path of an error, without the keys that pydantic adds for unions, up to the first missing key."""
    names: list[str] = []
    for key in keys:
        if not isinstance(settings, Mapping | list):
            break
        try:
            settings = cast("Any", settings)[key]
        except (KeyError, IndexError, TypeError):
            if isinstance(settings, Mapping) and key != keys[-1]:
                continue  # the member of a union
            return [*names, str(key)] if isinstance(settings, Mapping) else names
        names.append(str(key))
    return names

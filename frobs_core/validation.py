"""Checking settings against pydantic models, with errors that name the key, the file and the nearest name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast, get_args

from frobs_core.errors import ConfigFileError, ConfigurationError, UnknownParameterError
from frobs_core.yaml import find_origin

if TYPE_CHECKING:
    from pydantic import BaseModel

Model = TypeVar("Model", bound="BaseModel")


def validate(model: type[Model], settings: Mapping[str, Any], owner: str) -> Model:
    """Build a model from settings.

    Args:
        model: A pydantic model that forbids extra keys.
        settings: Where it is a :class:`frobs_core.yaml.ConfigMapping`, errors name file and line.
        owner: What the settings are for: ``"algorithm 'ppo'"``.

    Returns:
        The model.

    Raises:
        UnknownParameterError: A key is unknown.
        ConfigurationError: A value cannot be used.
        ConfigFileError: Either, where the key was read from a file.
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
            name = ".".join(_present(settings, keys))
            value = "" if problem["type"] == "missing" else f" = {problem['input']!r}"
            error = ConfigurationError(f"{owner}: {name or 'settings'}{value}: {problem['msg']}.")
        origin = find_origin(settings, keys)
        if origin is not None:
            raise ConfigFileError(*origin, str(error)) from None
        raise error from None


def _fields(model: type[BaseModel], keys: tuple[int | str, ...]) -> list[str]:
    """Return the keys that the model takes at a place inside it."""
    for key in keys:
        if key not in model.model_fields:  # what pydantic adds for the members of a union
            continue
        inner = _model_in(model.model_fields[str(key)].annotation)
        if inner is None:
            return []
        model = inner
    return list(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model that an annotation is, or that one of its alternatives is."""
    from pydantic import BaseModel

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for part in get_args(annotation) if (found := _model_in(part)) is not None), None)


def _present(settings: object, keys: tuple[int | str, ...]) -> list[str]:
    """Leave out what pydantic adds for the members of a union; a key that is missing is kept."""
    names: list[str] = []
    for key in keys:
        if not isinstance(settings, Mapping | list):
            break
        try:
            settings = cast("Any", settings)[key]
        except (KeyError, IndexError, TypeError):
            return [*names, str(key)] if isinstance(settings, Mapping) else names
        names.append(str(key))
    return names

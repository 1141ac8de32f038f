"""Functions to import a plugin, call its hooks, and validate its records.

Errors are handled by :class:`frobs_core.plugins.Plugins`, not by these functions.
"""

from __future__ import annotations

import inspect
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import module_from_spec
from types import ModuleType

import pluggy

from frobs_core.deprecation import warn_deprecated
from frobs_core.plugins import hooks
from frobs_core.plugins.records import (
    EXTENSIONS,
    KINDS,
    RECORDS,
    CapabilityRecord,
    EnvironmentRecord,
    ParameterRecord,
    PolicyRecord,
    Record,
    SensorTypeRecord,
    TaskRecord,
)
from frobs_core.plugins.report import record_names
from frobs_core.util.errors import PluginError, nearest

HOOKS: Mapping[str, type[Record]] = {
    **{f"frobs_{kind}s": record for kind, record in KINDS.items()},
    "frobs_extensions": Record,
}
"""Class of the records that each hook returns."""

DEPRECATED_HOOKS: Mapping[str, type[Record]] = {
    "frobs_abilities": CapabilityRecord,
    "frobs_sensor_types": SensorTypeRecord,
    "frobs_parameters": ParameterRecord,
}
"""Hooks of version 0.2, which ``frobs_extensions`` replaces."""

_PROJECT = hooks.hookimpl.project_name
_MODULE = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
_NAME = re.compile(r"[a-z0-9_]+")
_POLICY_NAME = re.compile(rf"{_NAME.pattern}(:{_NAME.pattern})?")
_ENTRY_POINT = re.compile(rf"{_MODULE.pattern}:{_MODULE.pattern}")


def import_plugin(value: str) -> ModuleType:
    """Import the module that the ``value`` of an entry point names.

    Raises:
        PluginError: The entry point does not name a module.
        BaseException: Any exception that the import raises.
    """
    if not _MODULE.fullmatch(value):
        raise PluginError(f"the entry point is '{value}'; it must be the name of a module, such as 'package.plugin'")
    module = import_module(value)
    if not isinstance(module, ModuleType):
        raise PluginError(f"'{value}' replaced its module with {_article(module)}")
    spec = module.__spec__
    if getattr(spec, "_initializing", False) and spec is not None and spec.loader is not None:
        # The plugin's module was imported directly, and it imported FRobs before it defined its hooks. The import of
        # the module cannot be completed now, so the records are read from a second copy.
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    return module


def read_records(module: ModuleType, key: str) -> dict[str, tuple[Record, ...]]:
    """Call the hooks of a plugin and return its records by kind. The result contains all kinds.

    Args:
        module: Module of the plugin.
        key: ``"distribution:name"``.

    Raises:
        PluginError: The name of a hook is misspelled, or the result of a hook is invalid.
        BaseException: Any exception that a hook raises.
    """
    # Each plugin has a separate manager, so a failed plugin leaves no state in pluggy. In addition, hook wrappers do
    # not affect other plugins' hooks, and equal entry-point names do not collide.
    manager = pluggy.PluginManager(_PROJECT)
    manager.add_hookspecs(hooks)
    manager.register(_only_hooks(module), name=key)
    records: dict[str, list[Record]] = {kind: [] for kind in RECORDS}
    for hook, caller in vars(manager.hook).items():
        for implementation in caller.get_hookimpls():
            if hook in DEPRECATED_HOOKS:
                warn_deprecated(
                    f"the hook {hook} of '{key}'", instead="frobs_extensions", since="0.3", removed_in="0.4"
                )
            if (cls := HOOKS.get(hook) or DEPRECATED_HOOKS.get(hook)) is not None:
                # Called directly, because pluggy would hide a result of None, which indicates a forgotten 'return'.
                for record in _checked(hook, cls, implementation.function()):
                    records.setdefault(record.kind, []).append(record)
            elif not implementation.optionalhook:
                suggestion = nearest(hook, HOOKS)
                hint = f"did you mean '{suggestion}'?" if suggestion else f"available hooks: {', '.join(HOOKS)}"
                raise PluginError(f"there is no hook '{hook}'; {hint}")
    names = Counter(record_names(records))
    if twice := [name for name in names if names[name] > 1]:
        raise PluginError(f"{twice[0]} is provided twice")
    return {kind: tuple(offered) for kind, offered in records.items()}


def _only_hooks(module: ModuleType) -> ModuleType:
    """Return a module that contains only the functions marked as hooks.

    pluggy inspects every attribute that ``dir`` lists, and would thereby import all lazy attributes of a package.
    """
    hooks = ModuleType(module.__name__)
    for name, value in list(vars(module).items()):
        if inspect.isfunction(value) and hasattr(value, f"{_PROJECT}_impl"):
            for parameter in inspect.signature(value).parameters.values():
                if parameter.default is parameter.empty and not str(parameter).startswith("*"):
                    raise PluginError(f"the hook {name} has the parameter '{parameter}'; a hook has no parameters")
            setattr(hooks, name, value)
        elif name in HOOKS or name in DEPRECATED_HOOKS:
            raise PluginError(f"'{name}' must be a function with the decorator '@hookimpl'")
    if not any(inspect.isfunction(value) for value in vars(hooks).values()):
        raise PluginError(f"'{module.__name__}' has no function with the decorator '@hookimpl'")
    return hooks


def _checked(hook: str, cls: type[Record], returned: object) -> Sequence[Record]:
    if inspect.isgenerator(returned) or inspect.iscoroutine(returned):
        returned.close()
        raise PluginError(f"the hook {hook} is a {type(returned).__name__}; write a plain function that returns a list")
    if not isinstance(returned, (list, tuple)):
        raise PluginError(f"{hook} returned {_article(returned)}; return a list of {cls.__name__}")
    for record in returned:
        if not isinstance(record, cls):
            raise PluginError(f"{hook} returned {_article(record)}; it may only return {cls.__name__}")
        if cls is Record and (record.kind in KINDS or not _NAME.fullmatch(record.kind)):
            kinds = ", ".join(record.__name__ for record in EXTENSIONS.values())
            raise PluginError(f"{hook} returned {_article(record)}; it returns extensions, such as {kinds}")
        _check_record(record.kind, record)
    return returned


def _check_record(kind: str, record: Record) -> None:
    allowed = _POLICY_NAME if isinstance(record, PolicyRecord) else _NAME
    if not isinstance(record.name, str) or not allowed.fullmatch(record.name):
        rule = "use only lowercase letters, digits and underscores"
        raise PluginError(f"the {kind} name {record.name!r} is invalid; {rule}")
    owner = f"{kind} '{record.name}'"
    needs_none = record.entry_point == "" and isinstance(record, CapabilityRecord | ParameterRecord)
    if not needs_none and (not isinstance(record.entry_point, str) or not _ENTRY_POINT.fullmatch(record.entry_point)):
        raise PluginError(f"{owner}: entry_point is {record.entry_point!r}; it must have the form 'module:attribute'")
    for text in ("summary", "install_hint"):
        if not isinstance(getattr(record, text), str):
            raise PluginError(f"{owner}: {text} is {_article(getattr(record, text))}, not a string")
    for mapping in ("capabilities", "needs", "tuned"):
        if not isinstance(getattr(record, mapping, {}), Mapping):
            raise PluginError(f"{owner}: {mapping} is {_article(getattr(record, mapping))}, not a mapping")
    for mapping in ("capabilities", "needs"):
        for capability, level in getattr(record, mapping, {}).items():
            if not isinstance(level, int):
                raise PluginError(f"{owner}: {mapping}['{capability}'] is {level!r}; use a Level, such as Level.EXACT")
    for names in ("action_spaces", "suffixes", "methods"):
        if isinstance(getattr(record, names, ()), str):
            raise PluginError(f"{owner}: {names} is a str, not a tuple")
    if isinstance(record, TaskRecord):
        if not isinstance(record.environments, tuple):
            raise PluginError(f"{owner}: environments is {_article(record.environments)}, not a tuple")
        for environment in record.environments:
            if not isinstance(environment, EnvironmentRecord):
                raise PluginError(f"{owner}: environments contains {_article(environment)}")


def _article(value: object) -> str:
    name = type(value).__name__
    return "None" if value is None else f"{'an' if name[0] in 'aeiouAEIOU' else 'a'} {name}"

"""What is public has words, so that the reference that is written from it has them too."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
import textwrap
from collections.abc import Callable
from importlib import import_module
from types import SimpleNamespace

import gymnasium as gym
import pytest

import frobs_cli.errors
import frobs_core.util.errors
import frobs_deploy.errors
import frobs_train.errors
from frobs_cli.parameters import descriptions
from frobs_core import contracts as interfaces
from frobs_core import models, plugins
from frobs_core.plugins import capabilities, hooks, loading, registry
from frobs_devkit.testing import plugin as plugin_checks

specs = import_module("frobs_core.plugins.records")  # the package has a function of this name
HOOKS = [
    value
    for name, value in vars(hooks).items()
    if hasattr(value, "frobs_spec") and name not in loading.DEPRECATED_HOOKS
]
ERRORS = [
    value
    for module in (frobs_core.util.errors, frobs_cli.errors, frobs_deploy.errors, frobs_train.errors)
    for value in vars(module).values()
    if inspect.isclass(value) and value.__module__ == module.__name__
]
DATACLASSES = [
    value
    for module in (specs, interfaces, models, plugins)
    for value in vars(module).values()
    if dataclasses.is_dataclass(value) and inspect.isclass(value)
]


def short(value: object) -> str:
    return getattr(value, "__name__", str(value))


def test_there_is_a_hook_for_every_record() -> None:
    assert len(specs.KINDS) == 5
    assert [short(hook) for hook in HOOKS] == [*(f"frobs_{kind}s" for kind in specs.KINDS), "frobs_extensions"]


@pytest.mark.parametrize("hook", HOOKS, ids=short)
def test_the_example_of_a_hook_has_what_the_kit_demands(hook: Callable[..., object]) -> None:
    example = textwrap.dedent((inspect.getdoc(hook) or "").partition("Example::\n")[2].partition("\n\nDo not")[0])
    names = {**vars(specs), "hookimpl": hooks.hookimpl, "Level": capabilities.Level}
    exec(example, names)
    records = names[short(hook)]()
    kinds = {short(hook).removeprefix("frobs_").removesuffix("s")} if hook is not hooks.frobs_extensions else None
    assert all(type(record) is specs.RECORDS[record.kind] for record in records)
    assert {record.kind for record in records} == kinds or not kinds
    subject = SimpleNamespace(records=[(record.kind, record) for record in records])
    plugin_checks.summaries_are_one_line(subject)
    for record in records:
        for environment in getattr(record, "environments", ()):
            assert not registry._problem(environment)
        for levels in (getattr(record, "needs", {}), getattr(record, "capabilities", {})):
            assert set(levels) <= set(capabilities.CAPABILITIES)
        if record.entry_point and not record.entry_point.startswith("acme."):
            record.load()


@pytest.mark.parametrize("hook", HOOKS, ids=short)
def test_hooks_say_when_what_an_example_and_what_not(hook: object) -> None:
    text = inspect.getdoc(hook) or ""
    order = [" called ", "Return ", "Example::", "Do not "]
    places = [text.find(word) for word in order]
    assert -1 not in places, f"{short(hook)} lacks {order[places.index(-1)]!r}"
    assert places == sorted(places)


@pytest.mark.parametrize("cls", DATACLASSES, ids=short)
def test_fields_of_records_and_descriptions_are_explained(cls: type) -> None:
    explained = descriptions(cls)
    missing = [field.name for field in dataclasses.fields(cls) if field.name not in explained]
    assert not missing, f"{short(cls)} does not explain {missing}"


@pytest.mark.parametrize("error", ERRORS, ids=short)
def test_errors_are_explained_and_stand_in_the_tree(error: type[Exception]) -> None:
    assert error.__doc__
    assert re.search(rf"\b{error.__name__}\b", sys.modules[error.__module__].__doc__ or "")
    taken = [name for name in inspect.signature(error.__init__).parameters if name not in ("self", "args", "kwargs")]
    if error.__init__ is not Exception.__init__:
        assert [name for name in taken if name not in descriptions(error)] == []


def test_capabilities_say_what_they_mean() -> None:
    assert all(meaning for meaning in capabilities.CAPABILITIES.values())


@pytest.mark.parametrize("kind", specs.KINDS)
def test_installed_records_have_a_summary_in_one_line(kind: str) -> None:
    for name, record in plugins.records(kind).items():
        assert record.summary, name
        assert "\n" not in record.summary
        assert len(record.summary) <= 100
        assert record.install_hint, f"{name} does not say how to install what it needs"


@pytest.mark.parametrize("kind", ["controller", "task", "algorithm"])
def test_implementations_explain_their_parameters(kind: str) -> None:
    for name, record in plugins.records(kind).items():
        cls = record.load()
        assert cls.__doc__, name
        taken = inspect.signature(cls.__init__).parameters.values()
        missing = [p.name for p in taken if p.kind is p.KEYWORD_ONLY and p.name not in descriptions(cls)]
        assert not missing, f"{kind} '{name}' does not explain {missing}"


def test_environments_have_a_summary() -> None:
    found = registry.environments()
    assert found
    for env_id, (_, record) in found.items():
        assert record.summary, env_id
        assert env_id in gym.registry

"""A section for each kind: what is installed, as ``frobs list`` and ``frobs show NAME`` say it."""

from pathlib import Path
from typing import get_args

from pydantic import BaseModel

from frobs_cli.catalogue import listed, plural
from frobs_cli.describe_record import describe_record
from frobs_cli.parameters import descriptions
from frobs_core.plugins.records import KINDS
from generate import facts
from generate.rst import code, directive, escape, heading, label, table

_WITH_CLASS = ("controller", "task", "algorithm")
"""Kinds whose implementations' docstrings say what they are; a robot is data, a simulator's class is the contract's."""


def page() -> str:
    """Return the page."""
    text = label("plugins") + heading("Built-in plugins")
    text += "These plugins come with FRobs, sorted by kind. They use the same hooks as third-party plugins.\n\n"
    for kind in KINDS:
        text += label(plural(kind)) + heading(plural(kind).capitalize(), "-")
        rows = [(code(item.name), escape(item.record.summary), escape(item.distribution)) for item in listed(kind)]
        text += table(["name", "what it is", "distribution"], rows)
        text += "".join(_section(kind, item.name, item.record) for item in listed(kind))
    return text


def _section(kind, name, record) -> str:
    found = describe_record(kind, record)
    if Path(found.get("model", "")).is_absolute():  # a file that this machine has assembled
        found["model"] = Path(found["model"]).name
    text = label(f"{kind}-{name.replace('_', '-')}") + heading(name, "~")
    if "error" in found:
        text += f".. warning::\n\n   {escape(found['error'])}\n\n"
    elif kind in _WITH_CLASS:
        module, _, attribute = record.entry_point.partition(":")
        text += directive("autoclass", f"{module}.{attribute}", no_members="")
        if kind == "algorithm" and hasattr(record.load(), "config_model"):
            del found["defaults"]
            found["settings"] = settings(record.load().config_model)
    return text + facts.scalars(found) + facts.tables(found, skip=("parameters", "capabilities"))


def settings(model, prefix="") -> list[dict[str, str]]:
    """Return a row for each setting of a pydantic model, and for those of the models in it."""
    explained, rows = descriptions(model), []
    for name, field in model.model_fields.items():
        inner = next((part for part in (field.annotation, *get_args(field.annotation)) if is_model(part)), None)
        default = field.get_default(call_default_factory=True)
        row = {"name": prefix + name, "default": "…" if is_model(type(default)) else str(default)}
        rows += [row | {"help": explained.get(name, "")}]
        if inner is not None:
            rows += settings(inner, f"{prefix}{name}.")
    return rows


def is_model(value) -> bool:
    """Return whether it is a class of pydantic's models."""
    return isinstance(value, type) and issubclass(value, BaseModel)

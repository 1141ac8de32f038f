"""Functions that commands use to look up installed records and the distributions that provide them."""

from __future__ import annotations

from dataclasses import dataclass

from frobs_core import plugins, registry
from frobs_core.errors import PluginError, UnknownNameError
from frobs_core.specs import KINDS, Record

ENVIRONMENT = "environment"
_WORDS = {"env": ENVIRONMENT, "envs": ENVIRONMENT, "environments": ENVIRONMENT, ENVIRONMENT: ENVIRONMENT}


@dataclass(frozen=True)
class Listed:
    """A record and the distribution that provides it."""

    name: str  # has the prefix ``distribution:`` if two distributions provide a record with this name
    record: Record
    distribution: str
    version: str

    @property
    def source(self) -> str:
        """Distribution and version."""
        return f"{self.distribution} {self.version}".strip()


def kind_of(word: str) -> str:
    """Return the kind with the given singular or plural name. ``"environment"`` is considered a kind here."""
    known = {**{kind: kind for kind in KINDS}, **{plural(kind): kind for kind in KINDS}, **_WORDS}
    if word.lower() not in known:
        raise UnknownNameError("kind", word, [*(plural(kind) for kind in KINDS), "envs"])
    return known[word.lower()]


def plural(kind: str) -> str:
    """Return the plural name of a kind."""
    return f"{kind[:-1]}ies" if kind.endswith("y") else f"{kind}s"


def listed(kind: str) -> list[Listed]:
    """Return the records of a kind, sorted by name."""
    sources = {
        id(record): (report.distribution, report.version)
        for report in plugins.reports()
        for record in report.records.get(kind, ())
    }
    return [
        Listed(name, record, *sources.get(id(record), ("", "")))
        for name, record in sorted(plugins.records(kind).items())
    ]


def why_unusable(record: Record) -> str:
    """Return why a record's implementation cannot be imported and how to install it, or ``""`` if the import works."""
    try:
        record.load()
    except PluginError as error:
        return (
            f"the implementation cannot be imported; to install it: {record.install_hint}"
            if record.install_hint
            else str(error)
        )
    return ""


def source_of(kind: str, record: Record) -> str:
    """Return a record's distribution and version, or an empty string if the record does not come from a plugin."""
    return next((item.source for item in listed(kind) if item.record is record), "")


def problems() -> list[str]:
    """Return a message for each plugin that failed to load and for each environment ID that is unavailable."""
    return [*plugins.active().failures(), *registry.problems().values()]

"""What is installed, as commands show it: records with where they are from, environments, IDs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec

from frobs_core import plugins, registry
from frobs_core.errors import FrobsError, UnknownNameError
from frobs_core.specs import KINDS, EnvironmentRecord, Record, TaskRecord

ENVIRONMENT = "environment"
_WORDS = {"env": ENVIRONMENT, "envs": ENVIRONMENT, "environments": ENVIRONMENT, ENVIRONMENT: ENVIRONMENT}


@dataclass(frozen=True)
class Listed:
    """A record with the distribution that offers it.

    Attributes:
        name: What users write: with ``distribution:`` before it where two distributions offer it.
        record: The record.
        distribution: The pip package that holds it.
        version: Of the distribution.
    """

    name: str
    record: Record
    distribution: str
    version: str

    @property
    def source(self) -> str:
        """Distribution and version."""
        return f"{self.distribution} {self.version}".strip()


def kind_of(word: str) -> str:
    """Return the kind that a word means, singular or plural; ``"environment"`` is one here.

    Raises:
        UnknownNameError: It means none.
    """
    known = {**{kind: kind for kind in KINDS}, **{plural(kind): kind for kind in KINDS}, **_WORDS}
    if word.lower() not in known:
        raise UnknownNameError("kind", word, [*(plural(kind) for kind in KINDS), "envs"])
    return known[word.lower()]


def plural(kind: str) -> str:
    """Return the word for several of a kind."""
    return f"{kind}s"


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


def source_of(kind: str, record: Record) -> str:
    """Return distribution and version of a record, or nothing where it is from no plugin."""
    return next((item.source for item in listed(kind) if item.record is record), "")


def environments() -> Mapping[str, tuple[TaskRecord, EnvironmentRecord]]:
    """Return the environments that the installed tasks register, by ID."""
    return registry.environments()


def pretrained(env_id: str, environment: EnvironmentRecord) -> dict[str, Any] | None:
    """Return what is known of the trained policy that comes with an ID; a file that cannot be used is ``error``."""
    if not environment.pretrained:
        return None
    from frobs_core.pretrained import describe_pretrained, read_pretrained

    try:
        return describe_pretrained(read_pretrained(env_id))
    except FrobsError as error:
        return {"error": str(error)}


def bare_id(env_id: str) -> str:
    """Return an ID without the module that its self-importing form names."""
    return env_id.rpartition(":")[2]


def find_spec(env_id: str) -> EnvSpec:
    """Return Gymnasium's record of an ID, ours or not, importing the module that the ID names.

    Raises:
        UnknownNameError: No such ID; the nearest is named.
        AmbiguousNameError: Two distributions offer it.
        ConfigurationError: The module cannot be imported.
    """
    from frobs_core.runs.environments import find_spec as find

    if bare_id(env_id) in registry.problems():
        registry.find_environment(bare_id(env_id))
    return find(env_id)


def complete_id(incomplete: str) -> list[str]:
    """Return the IDs that a shell may complete to."""
    return [env_id for env_id in sorted(gym.registry) if env_id.startswith(incomplete)]


def problems() -> list[str]:
    """Return one line for each plugin that did not load, and for each ID that is not registered."""
    return [*plugins.active().failures(), *registry.problems().values()]

"""What is installed, as commands show it: records with where they are from, environments, IDs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec

from frobs_core import plugins, registry
from frobs_core.errors import UnknownNameError, nearest
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
    return dict(sorted(registry.environments().items()))


def bare_id(env_id: str) -> str:
    """Return an ID without the module that its self-importing form names."""
    return env_id.rpartition(":")[2]


def find_spec(env_id: str) -> EnvSpec:
    """Return Gymnasium's record of an ID, ours or not, importing the module that the ID names.

    Raises:
        UnknownNameError: No such ID or module; the nearest is named.
    """
    module, _, name = env_id.rpartition(":")
    if module:
        try:
            import_module(module)
        except ModuleNotFoundError as error:
            if error.name is None or not module.startswith(error.name):
                raise
            raise UnknownNameError("module", module, ["frobs_core"]) from None
    if name not in gym.registry:
        raise UnknownNameError("environment ID", name, _worth_naming(name), failed_plugins())
    return gym.registry[name]


def complete_id(incomplete: str) -> list[str]:
    """Return the IDs that a shell may complete to."""
    return [env_id for env_id in sorted(gym.registry) if env_id.startswith(incomplete)]


def failed_plugins() -> list[str]:
    """Return one line for each plugin that did not load."""
    return [
        f"{report.name} of {report.distribution} {report.version}: {report.cause}"
        for report in plugins.reports()
        if report.state == "failed"
    ]


def _worth_naming(name: str) -> Iterable[str]:
    """Return our IDs, and the one of all that Gymnasium knows which is most like ``name``."""
    ours = set(environments()) | {env_id for env_id in gym.registry if env_id.startswith("frobs/")}
    alike = nearest(name, gym.registry)
    return ours | ({alike} if alike else set())

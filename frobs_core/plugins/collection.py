"""Collections of plugins, which load each plugin in isolation, store the reports, and look up names."""

from __future__ import annotations

import json
import logging
import multiprocessing
import os
import sys
import threading
import traceback
from collections.abc import Iterable, Mapping
from contextlib import redirect_stdout
from functools import cache
from importlib.metadata import Distribution
from importlib.metadata import distributions as installed_distributions
from pathlib import Path
from time import perf_counter
from types import MappingProxyType

from frobs_core._version import __version__
from frobs_core.plugins.discovery import (
    Candidate,
    find_candidates,
    is_made_for,
    match_disabled,
    normalize,
)
from frobs_core.plugins.loading import import_plugin, read_records
from frobs_core.plugins.records import RECORDS, RECORDS_OF_CORE, Record
from frobs_core.plugins.report import PluginReport, record_names
from frobs_core.util.errors import (
    AmbiguousNameError,
    PluginError,
    PluginLoadError,
    UnknownNameError,
    check_name,
    nearest,
)

STRICT = "FROBS_STRICT_PLUGINS"
"""Environment variable that makes a broken plugin raise an error, unless its value is empty, 0, false, no or off."""

DISABLE = "FROBS_DISABLE_PLUGINS"
"""Environment variable with a comma-separated list of the entry points, distributions or ``distribution:name`` pairs to
disable.
"""

KNOWN_FILE = Path(__file__).with_name("known.json")
"""Names that the distributions of this project provide, for messages that suggest installation commands.
``.ci/known_names.py`` generates the file.
"""

_log = logging.getLogger("frobs")


@cache
def known() -> Mapping[str, Mapping[str, str]]:
    """Return the distribution that provides each name, by kind.

    In addition to the kinds of records, the kinds include ``"environment"`` and ``"command"``.
    """
    names: Mapping[str, Mapping[str, str]] = json.loads(KNOWN_FILE.read_text("utf-8"))
    return names


def install_command(kind: str, name: str) -> str:
    """Return the command that installs a record of this ``kind``, or an empty string if the name is unknown."""
    distribution = known().get(kind, {}).get(name, "")
    return f"pip install {distribution}" if distribution else ""


class Plugins:
    """The plugins of a set of distributions, loaded on first use.

    For each broken plugin, the logger ``frobs`` logs one line, and :meth:`reports` returns the details.

    Args:
        distributions: Distributions to search, or None to search all installed distributions.
        strict: Whether a broken plugin raises an error, or None to use ``FROBS_STRICT_PLUGINS``.
        disabled: Entry points, distributions or ``distribution:name`` pairs that must not be imported, or None to use
            ``FROBS_DISABLE_PLUGINS``.
        slow_seconds: Loading time above which a plugin is reported on stderr [s].
    """

    def __init__(
        self,
        distributions: Iterable[Distribution] | None = None,
        *,
        strict: bool | None = None,
        disabled: Iterable[str] | None = None,
        slow_seconds: float = 5.0,
    ) -> None:
        self._distributions = None if distributions is None else tuple(distributions)
        self._strict = strict
        self._disabled = disabled
        self._slow_seconds = slow_seconds
        self._lock = threading.RLock()
        self._loading = False
        self._reports: tuple[PluginReport, ...] | None = None
        self._offers: Mapping[str, Mapping[str, Mapping[str, PluginReport]]] = {}

    def reports(self) -> tuple[PluginReport, ...]:
        """Return the report of each plugin, sorted by distribution and name. The first call loads the plugins.

        Raises:
            PluginLoadError: A plugin is broken and ``strict`` is set.
            PluginError: A plugin looks up plugins while it is loaded.
        """
        if self._reports is None:
            with self._lock:
                if self._loading:
                    raise PluginError(
                        "plugins cannot be looked up while they are being loaded; look them up when your entry_point "
                        "is used, not when your plugin is imported"
                    )
                if self._reports is None:
                    self._loading = True
                    try:
                        self._load()
                    finally:
                        self._loading = False
        assert self._reports is not None
        return self._reports

    def records(self, kind: str | type[Record]) -> Mapping[str, Record]:
        """Return the records of a kind by name; see :func:`frobs_core.plugins.records`."""
        offered = self._offers_of(kind)
        kind = kind if isinstance(kind, str) else kind.kind
        found = {}
        for name, offers in offered.items():
            for distribution, report in offers.items():
                key = name if len(offers) == 1 else f"{distribution}:{name}"
                found[key] = _record(report, kind, name)
        return MappingProxyType(dict(sorted(found.items())))

    def get_record(self, kind: str, name: str) -> Record:
        """Return a record. For the arguments and errors, see :func:`frobs_core.plugins.get_record`."""
        bare = name if name in self._offers_of(kind) else name.rpartition(":")[2]
        return _record(self.get_report(kind, name), kind, bare)

    def get_report(self, kind: str, name: str) -> PluginReport:
        """Return the report of the plugin that provides a record.

        For the arguments and errors, see :func:`frobs_core.plugins.get_record`.
        """
        distribution, _, bare = name.rpartition(":")
        if name in self._offers_of(kind):  # the name of a policy may contain a colon
            distribution, bare = "", name
        offers = self._offers_of(kind).get(bare, {})
        if distribution:
            offers = {d: report for d, report in offers.items() if normalize(d) == normalize(distribution)}
        if len(offers) > 1:
            raise AmbiguousNameError(kind, bare, [report.origin for report in offers.values()])
        if not offers:
            hint = self.install_hint(kind, name) or self.install_hint(kind, bare)
            raise UnknownNameError(kind, name, self.records(kind), self.failures(), hint)
        return next(iter(offers.values()))

    def install_hint(self, kind: str, name: str) -> str:
        """Return the installation command for the distribution of this project that provides a name.

        Args:
            kind: A kind of record, or ``"environment"``.
            name: Name of the record, or ID of the environment.

        Returns:
            The command, or an empty string if the name is unknown or a plugin of its distribution is installed.
        """
        package = known().get(kind, {}).get(name, "")
        if any(normalize(report.distribution) == package for report in self.reports()):
            return ""
        return install_command(kind, name)

    def failures(self) -> tuple[str, ...]:
        """Return one line for each plugin that is not loaded, with its name, distribution, version and cause."""
        return tuple(f"'{r.name}' of {r.origin}: {r.cause}" for r in self.reports() if r.state != "loaded")

    def _offers_of(self, kind: str | type[Record]) -> Mapping[str, Mapping[str, PluginReport]]:
        self.reports()
        if not isinstance(kind, str):
            return self._offers.get(kind.kind, {})
        check_name("kind", kind, self._offers)
        return self._offers[kind]

    def candidates(self) -> list[Candidate]:
        """Return the entry points of all plugins, sorted by distribution and name, without importing them."""
        return find_candidates(installed_distributions() if self._distributions is None else self._distributions)

    def disabled(self) -> set[str]:
        """Return the ``"distribution:name"`` of each disabled plugin."""
        return match_disabled(self.candidates(), self._disabled_words())[0]

    def _load(self) -> None:
        candidates = self.candidates()
        off, unknown = match_disabled(candidates, self._disabled_words())
        reports: list[PluginReport] = []
        with _Watch(self._slow_seconds) as watch:
            for candidate in candidates:
                if candidate.key in off:
                    cause = f"disabled by {DISABLE}"
                    reports.append(PluginReport(**vars(candidate), state="disabled", cause=cause))
                    continue
                watch.loading = perf_counter(), candidate
                reports.append(self._load_one(candidate, reports))
        offers: dict[str, dict[str, dict[str, PluginReport]]] = {kind: {} for kind in RECORDS}
        own = Candidate("core", "frobs-core", __version__, "frobs_core.plugins.records")
        for report in (PluginReport(**vars(own), state="loaded", records=RECORDS_OF_CORE), *reports):
            for kind, records in report.records.items():
                for record in records:
                    offers.setdefault(kind, {}).setdefault(record.name, {})[report.distribution] = report
        self._offers, self._reports = offers, tuple(reports)
        for word in unknown:
            suggestion = nearest(word, [w for c in candidates for w in (c.name, c.distribution)])
            hint = f"; did you mean '{suggestion}'?" if suggestion else ""
            warn(f"{DISABLE} contains '{word}', which is not an installed plugin{hint}")

    def _load_one(self, candidate: Candidate, others: Iterable[PluginReport]) -> PluginReport:
        origin = candidate.origin
        mismatch = f"requires frobs-core {candidate.made_for}, but version {__version__} is installed"
        warning = ""
        start = perf_counter()
        seconds = 0.0
        try:
            if candidate.problem:
                raise PluginError(candidate.problem)
            # stdout is reserved for the program that imports FRobs, such as a command that writes JSON.
            with redirect_stdout(sys.stderr):
                module = import_plugin(candidate.value)
                seconds = perf_counter() - start
                records = read_records(module, candidate.key)
            _check_unique(candidate, records, others)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # also catches SystemExit and a test framework's exceptions
            cause = _one_line(error)
            if not is_made_for(candidate.made_for, __version__):
                cause += f"; the plugin {mismatch}"
            if self._is_strict():
                raise PluginLoadError(candidate.name, origin, cause) from error
            warn(f"plugin '{candidate.name}' of {origin} did not load: {cause}")
            lines = "".join(traceback.format_exception(error))
            seconds = seconds or perf_counter() - start
            return PluginReport(**vars(candidate), state="failed", cause=cause, traceback=lines, import_seconds=seconds)
        if not is_made_for(candidate.made_for, __version__):
            upgrade = f"to upgrade the plugin, run: pip install --upgrade {candidate.distribution}"
            warning = f"plugin '{candidate.name}' of {origin} {mismatch}; {upgrade}"
            warn(warning)
        return PluginReport(
            **vars(candidate),
            state="loaded",
            import_seconds=seconds,
            records=MappingProxyType(records),
            warning=warning,
        )

    def _is_strict(self) -> bool:
        if self._strict is not None:
            return self._strict
        return os.environ.get(STRICT, "").strip().lower() not in ("", "0", "false", "no", "off")

    def _disabled_words(self) -> list[str]:
        words = os.environ.get(DISABLE, "").split(",") if self._disabled is None else self._disabled
        return [word.strip() for word in words if word.strip()]


class _Watch:
    """Thread that reports slow plugins on stderr, because a hanging import cannot be stopped from within the process.

    A single thread watches all plugins, because starting one thread per plugin would take longer than the imports on a
    busy machine.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._ended = threading.Event()
        self.loading: tuple[float, Candidate] | None = None  # start time and plugin
        self._thread = threading.Thread(target=self._look, daemon=True)

    def __enter__(self) -> _Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()  # ensures that the thread is not running when the process forks

    def _look(self) -> None:
        while not self._ended.wait(min(0.25, self._seconds / 4)):
            start, candidate = self.loading or (perf_counter(), None)
            if candidate is not None and perf_counter() - start >= self._seconds:
                self.loading = None  # report it only once
                sys.stderr.write(
                    f"frobs: plugin '{candidate.name}' of {candidate.origin} is still loading after {self._seconds:g} s; "
                    f"if it does not finish, set {DISABLE}={candidate.key}\n"
                )


def warn(line: str) -> None:
    """Log a warning. In a worker process, use the debug level, because the parent has already logged the warning."""
    _log.log(logging.DEBUG if multiprocessing.parent_process() else logging.WARNING, "%s", line)


def _record(report: PluginReport, kind: str, name: str) -> Record:
    return next(record for record in report.records[kind] if record.name == name)


def _check_unique(
    candidate: Candidate, records: Mapping[str, tuple[Record, ...]], others: Iterable[PluginReport]
) -> None:
    """Reject names from another plugin of the same distribution, because ``distribution:name`` must be unique."""
    for other in others:
        if other.distribution == candidate.distribution:
            taken = record_names(other.records)
            for name in record_names(records):
                if name in taken:
                    text = f"{name} is also provided by plugin '{other.name}' of the same distribution"
                    raise PluginError(text)


def _one_line(error: BaseException) -> str:
    """Return an exception's class and the first line of its message, shortened if it is long."""
    try:
        text = next(iter(str(error).strip().splitlines()), "")
    except Exception:  # a broken __str__
        text = ""
    if isinstance(error, PluginError) and text:
        return text
    return f"{type(error).__name__}: {text[:300]}" if text else type(error).__name__

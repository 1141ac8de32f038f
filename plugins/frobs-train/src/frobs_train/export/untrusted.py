"""Check that an untrusted policy bundle contains only registered names, listed wrappers and plain data."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from frobs_core.errors import UntrustedFileError
from frobs_train.configuration.config import RunConfig

PARTS = ("task", "robot", "controller", "simulator")
"""Keyword arguments of the environment whose values are names of registered components."""

WRAPPERS: Mapping[str, int] = {
    **{
        f"frobs_core.wrappers:{name}": 10**7
        for name in ("NormalizeActionWrapper", "NormalizeObservationWrapper", "TimeLimitWrapper")
    },
    "gymnasium.wrappers:TimeLimit": 10**7,
    "gymnasium.wrappers:FrameStackObservation": 100,
    **{
        f"gymnasium.wrappers:{name}": 1_000
        for name in (
            "ClipAction",
            "ClipReward",
            "DelayObservation",
            "FilterObservation",
            "FlattenObservation",
            "GrayscaleObservation",
            "MaxAndSkipObservation",
            "NormalizeObservation",
            "NormalizeReward",
            "RecordEpisodeStatistics",
            "RescaleAction",
            "RescaleObservation",
            "ResizeObservation",
            "StickyAction",
            "TimeAwareObservation",
        )
    },
    **{
        f"gymnasium.wrappers.vector:{name}": 1_000
        for name in (
            "ClipAction",
            "ClipReward",
            "FlattenObservation",
            "NormalizeObservation",
            "NormalizeReward",
            "RecordEpisodeStatistics",
            "RescaleAction",
        )
    },
}
"""Wrappers that a bundle may use, each with its largest accepted integer argument. The wrappers do not write files."""

MAX_PIXELS = 2**22
"""Maximum total number of pixels in the images of one observation. Larger images could exhaust the memory."""

_USUAL = (84, 84)  # default size of an image [pixels]

_OWN = ("frobs_core",)  # modules that are always imported
_NAME = re.compile(r"[\w.-]+(:[\w.-]+)?")  # optionally "distribution:name"
_FILE = re.compile(r"[/\\~$:\0]|\.[A-Za-z]\w*$|^\.+$")  # text that indicates a path, a URL or an import name


def check_config(path: Path, config: RunConfig) -> None:
    """Check the configuration of a bundle before anything in it is imported or created.

    Raises:
        UntrustedFileError: The configuration names a module, a file or an unlisted wrapper, or is not plain data.
    """
    for reason in _reasons(config):
        raise UntrustedFileError(path, reason)


def _reasons(config: RunConfig) -> Iterator[str]:
    module = config.environment.rpartition(":")[0]
    if module and module not in _OWN:
        yield f"the bundle imports the module '{module}' (environment '{config.environment}')"
    for key, value in config.environment_kwargs.items():
        name = f"environment_kwargs.{key}"
        if key == "package_paths" and value:
            yield f"the bundle names folders ({name})"
        elif key in PARTS and isinstance(value, str):
            if not _NAME.fullmatch(value) or _FILE.search(value.rpartition(":")[2]):
                yield f"the bundle names a file or a module ({name} = '{value}') instead of a registered {key}"
        else:
            yield from _not_plain(name, value)
    yield from _too_large(config.environment_kwargs.get("observations"))
    yield from _not_plain("randomize", config.randomize)
    for part in config.wrappers:
        if part.name not in WRAPPERS:
            yield f"the bundle imports the wrapper '{part.name}'; allowed wrappers are {', '.join(WRAPPERS)}"
        yield from _not_plain(f"wrapper '{part.name}'", part.kwargs, WRAPPERS.get(part.name))


def _too_large(observations: Any) -> Iterator[str]:
    """Yield a reason to reject the bundle if its images have too many pixels. Invalid terms are detected later."""
    terms = observations.values() if isinstance(observations, Mapping) else ()
    sizes = [term.get("size", _USUAL if "camera" in term else None) for term in terms if isinstance(term, Mapping)]
    pairs = [size for size in sizes if isinstance(size, list | tuple) and len(size) == 2]
    pixels = sum(abs(h * w) for h, w in pairs if isinstance(h, int) and isinstance(w, int))
    if pixels > MAX_PIXELS:
        yield f"the images of the bundle have {pixels:,} pixels in total, which exceeds the limit of {MAX_PIXELS:,}"


def _not_plain(name: str, value: Any, largest: int | None = None) -> Iterator[str]:
    """Yield a reason to reject the bundle for each value that is too large or is not plain data."""
    if isinstance(value, Mapping):
        yield from _each(((f"{name}.{key}", item) for key, item in value.items()), largest)
        yield from _each(((f"a key of {name}", key) for key in value), largest)
    elif isinstance(value, list | tuple):
        yield from _each(((f"{name}[{i}]", item) for i, item in enumerate(value)), largest)
    elif isinstance(value, str):
        if _FILE.search(value) or os.path.isfile(value):
            yield f"the bundle names a file or a module ({name} = '{value}')"
    elif largest is not None and isinstance(value, int) and abs(value) > largest:
        yield f"{name} = {value:,} exceeds the limit of {largest:,}"
    elif not (value is None or isinstance(value, bool | int | float)):
        yield f"{name} is a {type(value).__name__}, which is not plain data"


def _each(items: Iterable[tuple[str, Any]], largest: int | None) -> Iterator[str]:
    for name, value in items:
        yield from _not_plain(name, value, largest)

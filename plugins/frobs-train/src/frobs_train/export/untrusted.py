"""Check that an untrusted policy bundle contains only registered names, listed wrappers and plain data."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

from frobs_core.contracts import Task
from frobs_core.util.budgets import Meter
from frobs_core.util.errors import UntrustedFileError
from frobs_train.configuration.config import RunConfig

PARTS = ("task", "robot", "controller", "simulator")
"""Keyword arguments of the environment whose values are names of registered components."""

_WRAPPERS = {
    "frobs_rl_compat.wrappers": "NormalizeActionWrapper NormalizeObservationWrapper TimeLimitWrapper",
    "gymnasium.wrappers": "ClipAction ClipReward DelayObservation FilterObservation FlattenObservation "
    "FrameStackObservation GrayscaleObservation MaxAndSkipObservation NormalizeObservation NormalizeReward "
    "RecordEpisodeStatistics RescaleAction RescaleObservation ResizeObservation StickyAction TimeAwareObservation "
    "TimeLimit",
    "gymnasium.wrappers.vector": "ClipAction ClipReward FlattenObservation NormalizeObservation NormalizeReward "
    "RecordEpisodeStatistics RescaleAction",
}

WRAPPERS = frozenset(f"{module}:{name}" for module, names in _WRAPPERS.items() for name in names.split())
"""Wrappers that a bundle may use. They do not write files."""

_STEPS = "control steps of an episode"
_WORK = "environment steps of a control step"
_FRAMES = "stacked or delayed observations"

_ARGUMENTS: Mapping[str, str] = {
    "max_episode_steps": _STEPS,
    "max_steps": _STEPS,
    "skip": _WORK,
    "frame_skip": _WORK,
    "repeat": _WORK,
    "stack_size": _FRAMES,
    "delay": _FRAMES,
}
"""Integer arguments of environments and wrappers by what they multiply. The product over the bundle is limited."""

_NUMBERS = ("num_envs", "steps", "seed", "evaluation_episodes")
_USUAL_SKIP = 4  # default of MaxAndSkipObservation
_USUAL = (84, 84)  # default size of an image [pixels]

_OWN = ("frobs_core",)  # modules that are always imported
_NAME = re.compile(r"[\w.-]+(:[\w.-]+)?")  # optionally "distribution:name"
_FILE = re.compile(r"[/\\~$:\0]|\.[A-Za-z]\w*$|^\.+$")  # text that indicates a path, a URL or an import name

BUDGET: Mapping[str, int] = {
    "values of the configuration": 2_000,
    "characters of the configuration": 20_000,
    "bits of an integer": 64,
    "control steps of an episode": 100_000,
    "environment steps of a control step": 1_000,
    "stacked or delayed observations": 100,
    "pixels of an observation": 2**20,
}
"""Limits of the configuration of a policy bundle. ``frobs_deploy.budgets`` has those of its files and its graph."""


def check_config(path: Path, config: RunConfig) -> None:
    """Raise UntrustedFileError if a bundle's configuration is not safe, before anything in it is imported or created.

    It must not name modules, files or unlisted wrappers, must be plain data, and must stay within the budget.
    """

    def refuse(reason: str) -> NoReturn:
        raise UntrustedFileError(path, reason)

    _check_size(config, Meter(BUDGET, lambda reason: refuse(f"the configuration is too large: {reason}")))
    for reason in _reasons(config):
        refuse(reason)


def _check_size(config: RunConfig, meter: Meter) -> None:
    """Check the number and size of all values, and what the environment and its wrappers need together.

    An environment builds tables from its arguments, and a wrapper multiplies what the wrappers inside it need.
    Therefore the limits apply to the whole bundle instead of each argument.
    """
    values = config.model_dump()
    _weigh({key: values[key] for key in ("environment_kwargs", "randomize", "wrappers", *_NUMBERS)}, meter)
    parts = [config.environment_kwargs, *(part.kwargs for part in config.wrappers)]
    products = dict.fromkeys((_WORK, _FRAMES), 1)
    for part in parts:
        for key, what in _ARGUMENTS.items():
            if what == _STEPS:
                meter.check(what, _whole(part.get(key)))
            else:
                products[what] *= max(_whole(part.get(key)), 1)
    products[_WORK] *= math.prod(
        _USUAL_SKIP for part in config.wrappers if part.name.endswith(":MaxAndSkipObservation") and not part.kwargs
    )
    meter.check(_WORK, products[_WORK] * _physics_steps(config.environment_kwargs))
    meter.check(_FRAMES, products[_FRAMES])
    meter.check("pixels of an observation", _pixels(parts) * products[_FRAMES])


def _weigh(value: Any, meter: Meter) -> None:
    """Count the values and the characters of plain data, and check its numbers. ``value`` is not deeply nested."""
    meter.spend("values of the configuration")
    if isinstance(value, str):
        meter.spend("characters of the configuration", len(value))
    elif isinstance(value, Mapping):
        for key, item in value.items():
            _weigh(key, meter)
            _weigh(item, meter)
    elif isinstance(value, list | tuple):
        for item in value:
            _weigh(item, meter)
    elif isinstance(value, int):
        meter.check("bits of an integer", value.bit_length())


def _whole(value: Any) -> int:
    """Return a number as an integer that is not smaller, and 0 for other values."""
    if not isinstance(value, int | float) or math.isnan(value):
        return 0
    return math.ceil(value) if math.isfinite(value) else 2**63


def _physics_steps(kwargs: Mapping[str, Any]) -> int:
    """Return the number of physics steps per control step, based on the defaults of tasks."""
    control, physics = (
        value if isinstance(value := kwargs.get(name), int | float) and 0 < value < math.inf else default
        for name, default in (
            ("control_timestep", Task.control_timestep),
            ("physics_timestep", Task.physics_timestep),
        )
    )
    return math.ceil(min(control / physics, 2.0**53) - 1e-9)


def _pixels(parts: Iterable[Mapping[str, Any]]) -> int:
    """Return the number of pixels of all images, or of a larger image that is rendered or made by a wrapper."""
    pixels = 0
    for part in parts:
        terms = part.get("observations")
        terms = terms.values() if isinstance(terms, Mapping) else ()
        sizes = [term.get("size", _USUAL if "camera" in term else None) for term in terms if isinstance(term, Mapping)]
        pairs = [size for size in sizes if isinstance(size, list | tuple) and len(size) == 2]
        pixels += sum(abs(h * w) for h, w in pairs if isinstance(h, int) and isinstance(w, int))
        for shape in (part.get("shape"), part.get("render_size"), (part.get("width"), part.get("height"))):
            if isinstance(shape, list | tuple) and all(isinstance(size, int) for size in shape):
                pixels = max(pixels, math.prod(map(abs, shape)))
    return pixels


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
    yield from _not_plain("randomize", config.randomize)
    for part in config.wrappers:
        if part.name not in WRAPPERS:
            yield (f"the bundle imports the wrapper '{part.name}'; allowed wrappers are {', '.join(sorted(WRAPPERS))}")
        yield from _not_plain(f"wrapper '{part.name}'", part.kwargs)


def _not_plain(name: str, value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        yield from _each((f"{name}.{key}", item) for key, item in value.items())
        yield from _each((f"a key of {name}", key) for key in value)
    elif isinstance(value, list | tuple):
        yield from _each((f"{name}[{i}]", item) for i, item in enumerate(value))
    elif isinstance(value, str):
        if _FILE.search(value) or os.path.isfile(value):
            yield f"the bundle names a file or a module ({name} = '{value}')"
    elif not (value is None or isinstance(value, bool | int | float)):
        yield f"{name} is a {type(value).__name__}, which is not plain data"


def _each(items: Iterable[tuple[str, Any]]) -> Iterator[str]:
    for name, value in items:
        yield from _not_plain(name, value)

"""Checks of an algorithm, on a small environment of Gymnasium's."""

from __future__ import annotations

import io
import pickle
import pickletools
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode

from frobs_core import plugins
from frobs_core.errors import CheckpointError, UnknownParameterError, UntrustedFileError
from frobs_core.interfaces import Algorithm
from frobs_core.specs import AlgorithmRecord
from frobs_core.testing.checks import Check, CheckFailure, Hollow, NotApplicable, Outcome, collect, expect
from frobs_core.testing.compare import difference, expect_same

_ENVIRONMENTS = {"Box": "Pendulum-v1", "Discrete": "CartPole-v1"}
_NUM_ENVS = 2
_SAFE_MODULES = ("torch", "collections", "_codecs", "numpy")


class _Monitor:
    """Counts what it is told."""

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.offers = 0

    def on_progress(self, steps: int, metrics: Mapping[str, float]) -> bool:
        self.steps.append(steps)
        return True

    def offer_checkpoint(self, steps: int, save: Callable[[Path], None]) -> None:
        self.offers += 1


@dataclass(frozen=True)
class AlgorithmUnderTest:
    """An algorithm by its record.

    Attributes:
        record: Its record.
        id: What it is tried on.
        config: Its settings.
        steps: Environment steps of a training.
    """

    record: AlgorithmRecord
    id: str
    config: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 300

    def make_env(self) -> gym.vector.VectorEnv[Any, Any, Any]:
        """Make the environment as a run does: same-step autoreset, seeded."""
        env = gym.make_vec(
            self.id, _NUM_ENVS, vectorization_mode="sync", vector_kwargs={"autoreset_mode": AutoresetMode.SAME_STEP}
        )
        env.reset(seed=3)
        return env

    @contextmanager
    def trained(self, steps: int | None = None, seed: int = 5) -> Iterator[tuple[Algorithm, _Monitor]]:
        """Train a new algorithm for a moment."""
        env, monitor = self.make_env(), _Monitor()
        try:
            cls: type[Algorithm] = self.record.load()
            algorithm = cls(env, cls.resolve_config(self.config), seed)
            if steps != 0:
                algorithm.train(steps or self.steps, monitor)
            yield algorithm, monitor
        finally:
            env.close()

    def observations(self, count: int) -> Any:
        """Draw observations of episodes; (count, …)."""
        env = gym.make(self.id)
        drawn = [env.reset(seed=seed)[0] for seed in range(count)]
        env.close()
        return np.stack(drawn)


def learns(subject: AlgorithmUnderTest) -> Outcome:
    """Training runs to its steps, tells of its progress in growing numbers, and changes the policy."""
    seen = subject.observations(8)
    with subject.trained(steps=0) as (algorithm, _):
        before = algorithm.predict(seen)[0].copy()
    with subject.trained() as (algorithm, monitor):
        expect(monitor.steps, "on_progress was never called.")
        expect(monitor.steps == sorted(monitor.steps), f"on_progress was told of falling steps: {monitor.steps}.")
        expect(monitor.steps[-1] >= subject.steps, f"training ended after {monitor.steps[-1]} of {subject.steps} steps.")
        expect(monitor.offers, "offer_checkpoint was never called; a run could never be resumed.")
        unchanged = difference(before, algorithm.predict(seen)[0]) is None
    return Hollow(f"{subject.steps} steps changed no prediction") if unchanged else None


def predicts_in_the_space(subject: AlgorithmUnderTest) -> Outcome:
    """Predictions for a batch are a batch of actions in the space; deterministic ones repeat; row i stands alone."""
    with subject.trained(steps=0) as (algorithm, _):
        seen = subject.observations(5)
        actions = algorithm.predict(seen)[0]
        expect(len(actions) == 5, f"5 observations give {len(actions)} actions.")
        for sampled in (actions, algorithm.predict(seen, deterministic=False)[0]):
            for action in sampled:
                typed = np.asarray(action).astype(algorithm.action_space.dtype)
                expect(algorithm.action_space.contains(typed), f"the action {action!r} is not in {algorithm.action_space}.")
        expect_same(actions, algorithm.predict(seen)[0], "a deterministic prediction, again")
        expect(np.allclose(actions[2:3], algorithm.predict(seen[2:3])[0], atol=1e-5), "row 2 alone gives another action.")
    return None


def same_seed_repeats(subject: AlgorithmUnderTest) -> Outcome:
    """The same seed learns the same; another seed learns something else."""
    seen = subject.observations(8)
    predictions = []
    for seed in (5, 5, 6):
        with subject.trained(seed=seed) as (algorithm, _):
            predictions.append(algorithm.predict(seen)[0].copy())
    expect_same(predictions[0], predictions[1], "predictions after training again with the same seed")
    if predictions[0].dtype.kind == "f":
        expect(difference(predictions[0], predictions[2]), "two seeds learn the same to the last bit.")
    return None


def load_equals_save(subject: AlgorithmUnderTest) -> Outcome:
    """What was saved predicts the same once it is loaded, without an environment and with one."""
    with tempfile.TemporaryDirectory() as folder, subject.trained() as (algorithm, _):
        algorithm.save(Path(folder))
        seen = subject.observations(8)
        expected = algorithm.predict(seen)[0]
        cls = type(algorithm)
        expect_same(expected, cls.load(Path(folder)).predict(seen)[0], "predictions of what was loaded")
        env = subject.make_env()
        expect_same(expected, cls.load(Path(folder), env).predict(seen)[0], "predictions of what was loaded with an env")
        env.close()
    return None


def unknown_settings_refused(subject: AlgorithmUnderTest) -> Outcome:
    """A setting that it does not know is refused, and named."""
    try:
        subject.record.load().resolve_config({**subject.config, "no_such_setting": 1})
    except UnknownParameterError as error:
        expect("no_such_setting" in str(error), f"the message does not name the setting: {error}")
        return None
    raise CheckFailure("a setting 'no_such_setting' passes; it must raise UnknownParameterError.")


def settings_resolve_once(subject: AlgorithmUnderTest) -> Outcome:
    """Resolved settings are plain values that YAML can hold, and resolving them again changes nothing."""
    cls: type[Algorithm] = subject.record.load()
    resolved = cls.resolve_config(subject.config)
    expect(cls.resolve_config(resolved) == resolved, "resolving resolved settings changes them.")
    odd = [f"{key}: {value!r}" for key, value in resolved.items() if not _is_plain(value)]
    expect(not odd, f"YAML cannot hold {', '.join(odd)}.")
    return None


def files_execute_nothing(subject: AlgorithmUnderTest) -> Outcome:
    """Nothing that is saved builds Python objects when it is opened; tensors and numbers alone."""
    with tempfile.TemporaryDirectory() as folder, subject.trained() as (algorithm, _):
        algorithm.save(Path(folder))
        files = [path for path in sorted(Path(folder).rglob("*")) if path.is_file()]
        expect(files, "save() wrote no file.")
        for path in files:
            for name, content in _contents(path):
                builds = _what_a_pickle_builds(content)
                expect(not builds, f"{name} is a pickle that builds {', '.join(sorted(builds)[:5])}; save tensors and JSON.")
                expect(b'":serialized:"' not in content, f"{name} holds a serialized Python object.")
    return None


def missing_files_are_told(subject: AlgorithmUnderTest) -> Outcome:
    """Loading from a folder that lacks a file, or holds a damaged one, raises CheckpointError."""
    with subject.trained(steps=0) as (algorithm, _), tempfile.TemporaryDirectory() as folder:
        algorithm.save(Path(folder))
        largest = max((path for path in Path(folder).rglob("*") if path.is_file()), key=lambda path: path.stat().st_size)
        for damage in ("is cut in half", "is missing"):
            if damage == "is missing":
                largest.unlink()
            else:
                largest.write_bytes(largest.read_bytes()[: largest.stat().st_size // 2])
            try:
                type(algorithm).load(Path(folder))
            except (CheckpointError, UntrustedFileError):
                continue
            except Exception as error:
                raise CheckFailure(
                    f"load() raises {type(error).__name__} where {largest.name} {damage}, not CheckpointError: {error}"
                ) from error
            raise CheckFailure(f"load() passes where {largest.name} {damage}; it must raise CheckpointError.")
    return None


def _is_plain(value: Any) -> bool:
    if isinstance(value, Mapping):
        return all(isinstance(key, str) and _is_plain(item) for key, item in value.items())
    if isinstance(value, list | tuple):
        return all(_is_plain(item) for item in value)
    return value is None or isinstance(value, bool | int | float | str)


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the name and content of a file, or those of what it packs."""
    data = path.read_bytes()
    if not zipfile.is_zipfile(io.BytesIO(data)):
        yield path.name, data
        return
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        for name in packed.namelist():
            yield f"{path.name}:{name}", packed.read(name)


def _what_a_pickle_builds(content: bytes) -> set[str]:
    """Return what a pickle would import beside tensors and plain containers; nothing where it is no pickle."""
    if content[:1] != pickle.PROTO:
        return set()
    found, strings = set(), []
    try:
        for opcode, argument, _ in pickletools.genops(content):
            if opcode.name in ("SHORT_BINUNICODE", "BINUNICODE", "UNICODE"):
                strings.append(str(argument))
            elif opcode.name == "GLOBAL":
                found.add(str(argument).replace(" ", "."))
            elif opcode.name == "STACK_GLOBAL":
                found.add(".".join(strings[-2:]))
    except ValueError:
        return set()
    return {name for name in found if name.split(".")[0] not in _SAFE_MODULES}


CHECKS = (
    learns,
    predicts_in_the_space,
    same_seed_repeats,
    load_equals_save,
    unknown_settings_refused,
    settings_resolve_once,
    files_execute_nothing,
    missing_files_are_told,
)
"""Every check of an algorithm, in the order in which they run."""


def check_algorithm(
    algorithm: str | AlgorithmRecord, config: Mapping[str, Any] | None = None, id: str | None = None, steps: int = 300
) -> list[Check]:
    """Return the checks of an algorithm.

    Args:
        algorithm: Its name, or a record that is not installed yet.
        config: Its settings, for a short training.
        id: What it is tried on; None: a small environment of Gymnasium's, by its action spaces.
        steps: Environment steps of a training.

    Raises:
        UnknownNameError: No algorithm has this name.
    """
    record = plugins.get_record("algorithm", algorithm) if isinstance(algorithm, str) else algorithm
    assert isinstance(record, AlgorithmRecord)
    chosen = id or next((_ENVIRONMENTS[kind] for kind in record.action_spaces if kind in _ENVIRONMENTS), "")
    if not chosen:
        spaces = ", ".join(record.action_spaces)
        none = NotApplicable(f"the kit has no environment with an action space {spaces}; give check_algorithm id=")
        return [Check("environment_is_given", "There is an environment to try it on.", lambda: none)]
    return collect(AlgorithmUnderTest(record, chosen, config or {}, steps), CHECKS)

"""Checks of the files that an algorithm saves, and of training that is resumed from them."""

from __future__ import annotations

import copy
import io
import pickle
import pickletools
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from frobs_core.contracts import Algorithm
from frobs_core.util.errors import CheckpointError, ConfigurationError, UntrustedFileError
from frobs_devkit.testing.algorithm.under_test import AlgorithmUnderTest, Monitor, Watched
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, after, expect, expect_raises
from frobs_devkit.testing.compare import difference, expect_close, expect_same

_SAFE_MODULES = ("torch", "collections", "_codecs", "numpy")


def load_equals_save(subject: AlgorithmUnderTest) -> None:
    """A saved algorithm predicts the same actions when it is loaded, with and without an environment."""
    algorithm = subject.trained[0]
    with tempfile.TemporaryDirectory() as folder:
        algorithm.save(Path(folder))
        expected, load = subject.predictions(algorithm), type(algorithm).load
        expect_same(expected, subject.predictions(load(Path(folder))), "predictions of the loaded algorithm")
        with closing(subject.make_env()) as env:
            expect_same(expected, subject.predictions(load(Path(folder), env)), "predictions loaded with an env")


def files_execute_nothing(subject: AlgorithmUnderTest) -> None:
    """Saved files contain only tensors and plain values, so opening them creates no arbitrary Python objects."""
    with tempfile.TemporaryDirectory() as folder:
        subject.trained[0].save(Path(folder))
        files = [path for path in sorted(Path(folder).rglob("*")) if path.is_file()]
        expect(files, "save() wrote no file.")
        for path in files:
            for name, content in _contents(path):
                builds = _what_a_pickle_builds(content)
                expect(
                    not builds,
                    f"the saved file {name} is a pickle that imports {', '.join(sorted(builds)[:5])}; save only "
                    "tensors and JSON.",
                )
                expect(b'":serialized:"' not in content, f"{name} contains a serialized Python object.")
                expect(
                    not _holds_objects(content),
                    f"the saved file {name} is an array of Python objects, which NumPy stores as a pickle; save only "
                    "arrays of numbers.",
                )


def missing_files_are_told(subject: AlgorithmUnderTest) -> None:
    """Loading a checkpoint with a missing or damaged file raises CheckpointError or UntrustedFileError."""
    algorithm = subject.untrained
    with tempfile.TemporaryDirectory() as folder, closing(subject.make_env()) as env:
        algorithm.save(Path(folder))
        files = [path for path in Path(folder).rglob("*") if path.is_file()]
        largest = max(files, key=lambda path: path.stat().st_size)
        for damage in ("is cut in half", "is missing"):
            if damage == "is missing":
                largest.unlink()
            else:
                largest.write_bytes(largest.read_bytes()[: largest.stat().st_size // 2])
            with expect_raises((CheckpointError, UntrustedFileError), f"load() where {largest.name} {damage}"):
                type(algorithm).load(Path(folder), env)


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the name and content of a file, or of each file in a ZIP archive."""
    data = path.read_bytes()
    if not zipfile.is_zipfile(io.BytesIO(data)):
        yield path.name, data
        return
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        for name in packed.namelist():
            yield f"{path.name}:{name}", packed.read(name)


def _holds_objects(content: bytes) -> bool:
    if not content.startswith(np.lib.format.MAGIC_PREFIX):
        return False
    try:
        np.load(io.BytesIO(content), allow_pickle=False)
    except ValueError:
        return True
    return False


def _what_a_pickle_builds(content: bytes) -> set[str]:
    """Return the names that a pickle imports from unsafe modules, or an empty set if the content is not a pickle."""
    if content[:1] != pickle.PROTO:
        return set()
    names, strings = set(), []
    try:
        for opcode, argument, _ in pickletools.genops(content):
            if opcode.name in ("SHORT_BINUNICODE", "BINUNICODE", "UNICODE"):
                strings.append(str(argument))
            elif opcode.name == "GLOBAL":
                names.add(str(argument).replace(" ", "."))
            elif opcode.name == "STACK_GLOBAL":
                names.add(".".join(strings[-2:]))
    except ValueError:
        return set()
    return {name for name in names if name.split(".")[0] not in _SAFE_MODULES}


class _SavingMonitor(Monitor):
    """A monitor that saves the first checkpoint at or after a given step, along with a copy of the environment.

    It also saves the first checkpoint of the training run, as the previous one.
    """

    def __init__(self, env: Watched, folder: Path, when: int) -> None:
        super().__init__(env)
        self.saved_at: int | None = None
        self.copied: Watched | None = None
        self._folder, self._previous, self._when = folder / "later", folder / "first", when

    def offer_checkpoint(self, steps: int, save: Callable[[Path, Path | None], None]) -> None:
        super().offer_checkpoint(steps, save)
        if not self._previous.exists():
            self._previous.mkdir()
            save(self._previous, None)
        elif steps >= self._when and self.saved_at is None:
            self._folder.mkdir()
            save(self._folder, self._previous)
            self.saved_at, self.copied = steps, copy.deepcopy(self.env)


@after("same_seed_repeats", "load_equals_save")
def continues_exactly(subject: AlgorithmUnderTest) -> None:
    """A training run that is resumed from a checkpoint continues exactly like an uninterrupted run.

    The checkpoint may share unchanged files with an earlier one.
    """
    if not subject.record.exact_resume:
        raise NotApplicable("the algorithm's record declares exact_resume=False")
    with closing(subject.make_env()) as env:
        try:
            copy.deepcopy(env).close()
        except Exception as error:
            raise NotApplicable(f"{subject.id} cannot be copied: {type(error).__name__}: {error}") from error
    total = subject.enough
    with tempfile.TemporaryDirectory() as folder:
        monitor = partial(_SavingMonitor, folder=Path(folder), when=total // 2)
        uninterrupted, saving = subject.train(total, monitor=monitor)
        assert isinstance(saving, _SavingMonitor)
        saved_at = saving.saved_at
        if saved_at is None or saving.copied is None:
            raise Inconclusive(
                "the algorithm offered no checkpoint in the second half of the training run; use settings with "
                "shorter iterations"
            )
        before, after = ([step for step in saving.steps if (step > saved_at) == late] for late in (False, True))
        if len(before) < 2 or len(after) < 2:
            raise Inconclusive(
                f"in a training run of {total} steps, {len(before)} iterations run before the checkpoint at step "
                f"{saved_at} and {len(after)} after it, but at least two are needed before and two after; use "
                "settings with shorter iterations, or more steps"
            )
        started = type(uninterrupted).load(Path(folder) / "later")
        if difference(subject.predictions(subject.untrained), subject.predictions(started)) is None:
            raise Inconclusive(
                f"training did not change the policy before the checkpoint at step {saved_at}; use settings with "
                "shorter iterations"
            )
        with closing(saving.copied) as copied:
            resumed = type(uninterrupted).load(Path(folder) / "later", copied)
            again = Monitor(copied)
            resumed.train(total, again)
    expect(again.steps == after, f"the resumed algorithm reports the step counts {again.steps} instead of {after}.")
    expect(
        saving.env.actions == saving.copied.actions,
        "the actions of a resumed training run differ from those of a whole one.",
    )
    expected, actual = subject.predictions(uninterrupted), subject.predictions(resumed)
    expect_same(expected, actual, "predictions of a resumed training run")
    for steps, row, row_again in zip(after, saving.rows[len(before) :], again.rows, strict=True):
        expect_same(row, row_again, f"the metrics at step {steps} of a resumed training run")


@after("same_seed_repeats", "load_equals_save")
def settings_can_change(subject: AlgorithmUnderTest) -> None:
    """If the algorithm implements ``load_with``, training continues from a checkpoint with the new settings."""
    trained, cls = subject.trained[0], subject.record.load()
    if cls.load_with.__func__ is Algorithm.load_with.__func__:  # type: ignore[attr-defined]
        raise NotApplicable("the algorithm does not implement load_with")
    subject.require_reproducible()
    config = subject.settings
    rates = [name for name, value in config.items() if isinstance(value, float) and 0.0 < value < 1.0]
    if not rates:
        raise Inconclusive("no setting is a number between 0 and 1, so the check does not know a setting to change")
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        trained.save(Path(folder))
        for factor in (1.0, 0.5):
            with closing(subject.make_env()) as env:
                changed = cls.resolve_config({**config, **{name: factor * config[name] for name in rates}})
                algorithm, monitor = cls.load_with(Path(folder), env, changed), Monitor(env)
                expected, actual = subject.predictions(trained), subject.predictions(algorithm)
                expect_same(expected, actual, "predictions after load_with")
                algorithm.train(2 * subject.enough, monitor)
                runs.append((algorithm, monitor))
    expect(
        subject.different(*runs),
        f"training that continues after load_with gives the same result with other values of {', '.join(rates)}.",
    )


def exported_policy_predicts(subject: AlgorithmUnderTest) -> None:
    """The graph that ``export_onnx`` returns predicts the same actions, if the algorithm can be exported."""
    algorithm, seen = subject.trained[0], subject.observations(8)
    if not isinstance(seen, np.ndarray) or algorithm.predict(seen)[1] is not None:
        raise NotApplicable("only for policies with one observation and without a state")
    try:
        graph = algorithm.export_onnx()
    except ConfigurationError as error:
        raise NotApplicable(str(error)) from error
    if find_spec("onnxruntime") is None:
        raise Inconclusive("onnxruntime is not installed: pip install onnxruntime")
    session = import_module("onnxruntime").InferenceSession(graph, providers=["CPUExecutionProvider"])
    expected = np.asarray(algorithm.predict(seen)[0])
    actual = np.asarray(session.run(["action"], {"observation": seen})[0])
    expect_close(expected, actual.reshape(expected.shape), 1e-4, "actions of the exported policy")


def policy_alone_predicts(subject: AlgorithmUnderTest) -> None:
    """A policy saved with ``save_policy`` predicts the same actions when it is loaded without an environment."""
    algorithm: Algorithm = subject.trained[0]
    with tempfile.TemporaryDirectory() as folder:
        algorithm.save_policy(Path(folder))
        expected, actual = (subject.predictions(a) for a in (algorithm, type(algorithm).load(Path(folder))))
        expect_same(expected, actual, "predictions of the separately saved policy")

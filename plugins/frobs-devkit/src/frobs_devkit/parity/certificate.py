"""The certificate: all results and versions, and the files it is written to."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from frobs_core.arrays import Floats
from frobs_core.errors import ConfigurationError
from frobs_core.files import write_aside, write_json, write_text
from frobs_core.plain import plain
from frobs_devkit.parity.actions import ActionFile
from frobs_devkit.parity.draw import draw
from frobs_devkit.parity.report import markdown
from frobs_devkit.parity.result import Measurement, Status

FORMAT = 1
"""Version of the format; it increases when the meaning of ``certificate.json`` changes."""

NAME = "certificate.json"
"""Removed first and written last, so that a folder with this file is complete."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Results for one environment.

    Attributes:
        id: Gymnasium ID.
        reference: Label of the simulator that the others are compared with.
        simulators: Labels of all simulators, reference first.
        facts: Facts about the environment: robot, controller, timesteps, …
        measurements: Measurements in the order in which they were made.
        versions: Versions of Python, NumPy, the engines and every distribution of FRobs, and the machine.
        actions: Actions of the replay; None if it was not made.
    """

    id: str
    reference: str
    simulators: tuple[str, ...]
    facts: Mapping[str, str]
    measurements: tuple[Measurement, ...]
    versions: Mapping[str, Any]
    actions: ActionFile | None = None

    @property
    def passed(self) -> bool:
        """Whether at least one comparison was made and none exceeds its tolerance."""
        statuses = {measurement.status for measurement in self.measurements}
        return Status.FAILED not in statuses and Status.PASSED in statuses

    @property
    def verdict(self) -> str:
        """Summary of the comparisons: ``"18 passed, 1 failed, 2 skipped"``."""
        statuses = [comparison.status for m in self.measurements for comparison in m.comparisons]
        counts = {status: statuses.count(status) for status in Status}
        return ", ".join(f"{count} {status}" for status, count in counts.items() if count)

    def to_dict(self) -> dict[str, Any]:
        """Return the certificate as JSON types; numbers that were not measured are None."""
        return {
            "format": FORMAT,
            "id": self.id,
            "passed": self.passed,
            "verdict": self.verdict,
            "reference": self.reference,
            "simulators": list(self.simulators),
            "facts": dict(self.facts),
            "measurements": [
                {
                    "name": measurement.name,
                    "title": measurement.title,
                    "summary": measurement.summary,
                    "status": str(measurement.status),
                    "comparisons": plain(measurement.comparisons),
                    "facts": dict(measurement.facts),
                    "picture": f"{measurement.name}.png" if measurement.panels else None,
                }
                for measurement in self.measurements
            ],
            "versions": dict(self.versions),
        }

    def write(self, folder: Path) -> None:
        """Write ``certificate.json``, ``certificate.md``, a PNG for each measurement, the curves and the actions.

        Everything is drawn before the first file is touched. ``certificate.json`` is removed first and written last, so
        that a folder with this file is complete.

        Raises:
            ConfigurationError: The folder cannot be created.
            RunError: matplotlib is not installed.
        """
        pictures = {f"{m.name}.png": draw(m, self.simulators) for m in self.measurements if m.panels}
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"the folder {folder} cannot be created: {error.strerror}; choose another with --out."
            ) from error
        stale = _pictures_of(folder / NAME) - pictures.keys()
        (folder / NAME).unlink(missing_ok=True)
        for name in stale:
            (folder / name).unlink(missing_ok=True)
        for name, picture in pictures.items():
            write_aside(folder / name, partial(Path.write_bytes, data=picture))
        write_aside(folder / "curves.npz", lambda aside: np.savez_compressed(aside, **curves(self.measurements)))  # type: ignore[arg-type]
        if self.actions is not None:
            self.actions.write(folder / "actions.json")
        write_text(folder / "certificate.md", markdown(self))
        write_json(folder / NAME, self.to_dict())


def curves(measurements: Sequence[Measurement]) -> dict[str, Floats]:
    """Return every line of every panel, (2, n), by ``measurement/panel/label/simulator``."""
    return {
        f"{measurement.name}/{p}/{line.label}/{line.simulator}": np.stack([line.x, line.y])
        for measurement in measurements
        for p, panel in enumerate(measurement.panels)
        for line in panel.lines
    }


def _pictures_of(path: Path) -> set[str]:
    """Return the images of the certificate that is replaced."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        pictures = {m["picture"] for m in json.loads(path.read_text("utf-8"))["measurements"] if m["picture"]}
        return {name for name in pictures if Path(name).name == name and name.endswith(".png")}
    return set()

"""Conformance checks for capabilities, sensor types, physical parameters, policies, viewers and commands."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any

import numpy as np

from frobs_cli.catalogue import EXTENSIONS, Listed, listed, load_command
from frobs_core import plugins
from frobs_core.contracts import Simulation
from frobs_core.description import Scene, Sensor
from frobs_core.models import Pose
from frobs_core.plugins.capabilities import known_capabilities
from frobs_core.plugins.records import SimulatorRecord
from frobs_core.sensing.sensors import Instrument, instrument_of
from frobs_core.util.errors import FrobsError, UnknownNameError, check_name
from frobs_devkit.testing.checks import Check, CheckFailure, Inconclusive, NotApplicable, after, collect, expect
from frobs_devkit.testing.policy import check_policy
from frobs_devkit.testing.robot.sensors import expect_sound
from frobs_devkit.testing.simulator.robots import ROVER
from frobs_devkit.testing.simulator.under_test import TIMESTEP, SimulatorUnderTest


@dataclass(frozen=True)
class ExtensionUnderTest:
    """An extension, with the fields of the sensor that its checks build."""

    kind: str
    item: Listed
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def record(self) -> Any:
        """The record of the extension."""
        return self.item.record

    def simulators(self, capability: str) -> Iterator[SimulatorUnderTest]:
        """Yield the importable simulators that declare a capability, or all of them if it is an empty string."""
        records = [plugins.get_record("simulator", name) for name in plugins.importable("simulator")]
        simulators = [one for one in records if isinstance(one, SimulatorRecord) and not one.is_paced]
        able = [one for one in simulators if not capability or one.capabilities.get(capability)]
        if not able:
            raise Inconclusive(f"no installed simulator that can be checked has the capability '{capability}'")
        yield from map(SimulatorUnderTest, able)


def name_is_free(subject: ExtensionUnderTest) -> None:
    """No other installed distribution provides an extension with the same kind and name."""
    record = subject.record
    expect(
        subject.item.name == record.name,
        f"another distribution also provides the {subject.kind} '{record.name}', so it is available only as "
        f"'{subject.item.name}'.",
    )


def summary_is_one_line(subject: ExtensionUnderTest) -> None:
    """The record has a one-line summary."""
    summary = subject.record.summary
    expect(
        summary.strip() and "\n" not in summary and len(summary) <= 120,
        f"the summary is {summary!r}; it must be a single line of at most 120 characters.",
    )


def simulators_implement_it(subject: ExtensionUnderTest) -> None:
    """Every simulator that declares the capability implements the capability's methods."""
    for simulator in subject.simulators(subject.item.name):
        cls = simulator.record.load()
        for method in subject.record.methods:
            expect(
                getattr(cls, method, None) is not getattr(Simulation, method, None),
                f"simulator '{simulator.record.name}' declares '{subject.item.name}', but its class {cls.__name__} "
                f"does not implement {method}().",
            )


def sensor_type_loads(subject: ExtensionUnderTest) -> None:
    """The entry point is a subclass of Sensor with this name, whose instrument and capability exist."""
    cls, record = subject.record.load(), subject.record
    expect(
        isinstance(cls, type) and issubclass(cls, Sensor), f"{record.entry_point} is {cls!r}, not a subclass of Sensor."
    )
    expect(
        cls.type_name == record.name, f"type_name of {cls.__name__} is '{cls.type_name}'; it must be '{record.name}'."
    )
    _expect_capability(cls.needs, f"needs of {cls.__name__}")
    instrument = instrument_of(cls)
    expect(
        isinstance(instrument, type) and issubclass(instrument, Instrument),
        f"the instrument {cls.instrument} is {instrument!r}, not a subclass of Instrument.",
    )


@after("sensor_type_loads")
def readings_are_in_range(subject: ExtensionUnderTest) -> None:
    """On a rover in each simulator with the sensor's capability, readings have the sensor's shape and range."""
    cls: type[Sensor] = subject.record.load()
    given = {"frame": "hull", **subject.settings}
    required = [item.name for item in fields(cls) if item.default is MISSING and item.default_factory is MISSING]
    missing = [name for name in required if name not in given]
    if missing:
        settings = " ".join(f"--set environment_kwargs.sensors.{cls.type_name}.{name}=VALUE" for name in missing)
        raise Inconclusive(f"the sensor needs {', '.join(missing)}; set them with {settings}")
    try:
        sensor = cls(**given)
    except (TypeError, FrobsError) as error:
        raise CheckFailure(f"the sensor cannot be built from {given}: {error}") from error
    name, instrument = subject.record.name, instrument_of(sensor)
    rover = replace(ROVER, sensors={name: sensor})
    contacts = dict(instrument.contacts(name, sensor, "robot", Scene()))
    for simulator in subject.simulators(cls.needs):
        with simulator.build(rover, num_envs=1, pose=Pose(pos=(0.0, 0.0, 0.05)), contacts=contacts) as (sim, robot):
            measuring = instrument(name, sensor, sim, robot, TIMESTEP)
            measuring.reset(None)
            sim.step(1)
            measuring.advance()
            expect_sound(name, sensor, np.asarray(measuring.measure()))


def capability_exists(subject: ExtensionUnderTest) -> None:
    """The parameter's capability is one of the core's or of an installed plugin."""
    _expect_capability(subject.record.capability, "the parameter's capability")


@after("capability_exists")
def values_are_kept(subject: ExtensionUnderTest) -> None:
    """In each simulator with the parameter's capability, written values can be read back, and only masked environments change."""
    name = subject.record.name
    for simulator in subject.simulators(subject.record.capability):
        with simulator.build(ROVER) as (sim, _):
            targets = list(sim.parameter_targets(name))
            if not targets and subject.item.distribution == "frobs-core":
                raise NotApplicable("the checks of each simulator verify this parameter: frobs check simulator:NAME")
            expect(targets, f"simulator '{simulator.record.name}' lists no targets of '{name}' in parameter_targets.")
            for target in targets:
                before = sim.parameter(name, target).copy()
                expect(
                    before.shape == (sim.num_envs,),
                    f"'{name}' of '{target}' has the shape {before.shape}, not ({sim.num_envs},).",
                )
                mask = np.arange(sim.num_envs) == 0
                expected = np.where(mask, np.where(before == 0.0, 0.01, 1.1 * before), before)
                sim.write_parameter(name, target, expected[mask], mask)
                actual = sim.parameter(name, target)
                expect(
                    np.allclose(actual, expected),
                    f"'{name}' of '{target}' is {actual.tolist()} after writing {expected[mask].tolist()} in the first "
                    f"environment; expected {expected.tolist()}.",
                )


def help_is_complete(subject: ExtensionUnderTest) -> None:
    """The command's function can be imported, and the help describes every argument and option."""
    loaded = load_command(subject.item.name)
    if loaded is None:
        raise NotApplicable("this is a group of commands")
    for parameter in loaded.params:
        expect(
            getattr(parameter, "help", None),
            f"'{parameter.name}' of 'frobs {subject.item.name}' has no help; add help='…'.",
        )


_CHECKS: Mapping[str, tuple[Callable[[ExtensionUnderTest], None], ...]] = {
    "capability": (name_is_free, summary_is_one_line, simulators_implement_it),
    "sensor_type": (name_is_free, summary_is_one_line, sensor_type_loads, readings_are_in_range),
    "parameter": (name_is_free, summary_is_one_line, capability_exists, values_are_kept),
    "policy": (name_is_free, summary_is_one_line),
    "viewer": (name_is_free, summary_is_one_line),
    "command": (summary_is_one_line, help_is_complete),
}


def check_extension(kind: str, name: str, settings: Mapping[str, Any] | None = None) -> list[Check]:
    """Return the conformance checks for an extension or a command.

    Args:
        kind: ``"capability"``, ``"sensor_type"``, ``"parameter"``, ``"policy"``, ``"viewer"`` or ``"command"``.
        name: Name of the extension.
        settings: For a sensor type, fields of the sensor to check, such as its required fields. For a policy,
            ``environment`` and ``environment_kwargs``, see :func:`check_policy`.

    Raises:
        UnknownNameError: There is no such kind, or no such extension.
    """
    check_name("kind of extension", kind, EXTENSIONS)
    items = {item.name: item for item in listed(kind)}
    if name not in items:
        raise UnknownNameError(kind.replace("_", " "), name, items, plugins.active().failures())
    settings = settings or {}
    checks = collect(ExtensionUnderTest(kind, items[name], settings), _CHECKS[kind])
    if kind == "policy":
        checks += check_policy(name, settings.get("environment", ""), **settings.get("environment_kwargs", {}))
    return checks


def _expect_capability(name: str, what: str) -> None:
    expect(
        not name or name in known_capabilities(),
        f"{what} is '{name}', which is not a capability: frobs list capabilities.",
    )

"""Checks of a robot's sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from frobs_core.description import Bumper, Lidar, Sensor
from frobs_core.plugins.records import Level
from frobs_core.sensing.sensors import instrument_of
from frobs_devkit.simulations import TIMESTEP
from frobs_devkit.testing.checks import Inconclusive, NotApplicable, expect
from frobs_devkit.testing.robot.under_test import RobotUnderTest


def sensors_are_fixed(subject: RobotUnderTest) -> None:
    """All sensor descriptions are valid, and all sensors are fixed to existing links."""
    links = [link.name for link in subject.model.links]
    for name, sensor in subject.robot.sensors.items():
        expect(isinstance(sensor, Sensor), f"sensor '{name}' is {sensor!r}; expected a Sensor object.")
        for frame in sensor.frames:
            expect(
                frame in links,
                f"sensor '{name}' is fixed to '{frame}', which is not a link; the links are {', '.join(links)}.",
            )


def lidars_look_around_once(subject: RobotUnderTest) -> None:
    """The rays of a lidar cover at most one full turn."""
    for name, lidar in subject.robot.lidars.items():
        turns = float(lidar.angles[-1] - lidar.angles[0]) / (2.0 * np.pi)
        expect(
            turns <= 1.0 + 1e-6,
            f"the rays of lidar '{name}' cover {turns:.3g} turns; specify angle_min and angle_max in radians.",
        )


def sensors_read(subject: RobotUnderTest) -> None:
    """At home on an empty floor, all readings are in range, no lidar ray is blocked, and no bumper is pressed."""
    assert subject.simulator is not None
    links, capabilities = {link.name for link in subject.model.links}, subject.simulator.capabilities
    sensors = {
        name: replace(sensor, rate=None, noise=0.0, resolution=0.0, delay=0.0, dropout=0.0)  # without faults
        for name, sensor in subject.robot.sensors.items()
        if links >= set(sensor.frames)  # sensors_are_fixed reports sensors on unknown links
    }
    if not sensors:
        raise NotApplicable("the robot has no sensors")
    lacking = {s.needs for s in sensors.values() if s.needs and not capabilities.get(s.needs, Level.UNSUPPORTED)}
    able = {name: sensor for name, sensor in sensors.items() if sensor.needs not in lacking}
    with RobotUnderTest(replace(subject.robot, sensors=able), subject.simulator).build() as (sim, robot):
        robot.command(robot.home.copy())
        instruments = {name: instrument_of(sensor)(name, sensor, sim, robot, TIMESTEP) for name, sensor in able.items()}
        for instrument in instruments.values():
            instrument.reset(None)
        sim.step(round(1.0 / TIMESTEP))
        for name, instrument in instruments.items():
            instrument.advance()
            expect_sound(name, able[name], instrument.measure())
    if lacking:
        raise Inconclusive(f"simulator '{subject.simulator.name}' does not support {', '.join(sorted(lacking))}")


def expect_sound(name: str, sensor: Sensor, read: np.ndarray) -> None:
    """Raise CheckFailure unless a reading in one environment has the sensor's shape and range."""
    expect(read.shape == (1, sensor.width), f"sensor '{name}' reads {read.shape}, not (1, {sensor.width}).")
    low, high = sensor.bounds
    expect(
        np.isfinite(read).all() and (read >= low).all() and (read <= high).all(),
        f"sensor '{name}' reads {read[0].tolist()}, not numbers in [{low}, {high}].",
    )
    if isinstance(sensor, Lidar):
        blind = np.flatnonzero(read[0] <= sensor.range_min).tolist()
        expect(
            not blind,
            f"rays {blind[:5]} of lidar '{name}' read range_min on an empty floor, because they start below the "
            "floor or hit it too close to the lidar; move the lidar with frame and offset, or reduce range_min.",
        )
    if isinstance(sensor, Bumper):
        expect(
            not read.any(),
            f"bumper '{name}' is pressed at home; add the objects that its links always touch to the bumper's "
            "'ignore' list.",
        )

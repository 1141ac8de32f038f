"""Noise, resolution, delay, rate and dropout, by the statistics of many environments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core.description import Bumper, Imu, Lidar
from frobs_core.sensing.sensors import Sensors
from frobs_core.util.errors import ConfigurationError, UnknownNameError

N = 1024
SCAN = Lidar(frame="hull", rays=3, angle_min=-0.1, angle_max=0.1, range_min=0.1, range_max=3.0)
ASIDE = replace(SCAN, angle_min=1.5, angle_max=1.6)  # it sees nothing

World = Callable[..., Any]


def correlation(first: Any, second: Any) -> float:
    return float(np.corrcoef(first.ravel(), second.ravel())[0, 1])


def test_an_ideal_sensor_reads_what_the_simulation_does(world: World) -> None:
    w = world(4, scan=SCAN)
    w.step()
    np.testing.assert_array_equal(w.sensors.read("scan"), w.robot.lidar("scan"))
    assert w.sensors.snapshot() == {}


def test_an_ideal_sensor_is_measured_once_in_a_step_and_only_if_it_is_read(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    w = world(2, scan=SCAN)
    calls = []
    lidar = type(w.robot).lidar
    monkeypatch.setattr(type(w.robot), "lidar", lambda self, name: calls.append(name) or lidar(self, name))
    w.step(3)
    assert calls == []
    w.sensors.read("scan")
    w.sensors.read("scan")
    assert calls == ["scan"]


def test_readings_are_read_only(world: World) -> None:
    w = world(2, scan=SCAN, noisy=replace(SCAN, noise=0.01))
    for name in w.sensors.names:
        with pytest.raises(ValueError, match="read-only"):
            w.sensors.read(name)[0] = 0.0


def test_noise_has_its_mean_and_deviation_and_no_memory(world: World) -> None:
    w = world(N, scan=replace(SCAN, noise=0.02))
    noise = w.watch("scan", 4) - w.robot.lidar("scan")
    count = noise.size
    assert abs(noise.mean()) < 5 * 0.02 / count**0.5
    assert noise.std() == pytest.approx(0.02, rel=5 / (2 * count) ** 0.5 + 0.01)
    assert abs(correlation(noise[:-1], noise[1:])) < 0.04  # between steps
    assert abs(correlation(noise[..., 0], noise[..., 1])) < 0.06  # between rays
    assert abs(correlation(noise[:, :-1], noise[:, 1:])) < 0.04  # between environments


def test_noise_of_two_sensors_differs(world: World) -> None:
    noisy = replace(SCAN, noise=0.02)
    w = world(N, left=noisy, right=noisy)
    w.step()
    assert abs(correlation(w.sensors.read("left"), w.sensors.read("right"))) < 0.08


def test_noise_stays_in_the_range_and_leaves_what_meets_nothing(world: World) -> None:
    w = world(N, aside=replace(ASIDE, noise=0.5), scan=replace(SCAN, noise=2.0))
    w.step()
    assert (w.sensors.read("aside") == 3.0).all()
    read = w.sensors.read("scan")
    assert read.min() == 0.1
    assert read.max() == 3.0


def test_noise_can_differ_between_elements(world: World) -> None:
    w = world(N, imu=Imu(frame="hull", noise=(0.1, 0.1, 0.1, 0.5, 0.5, 0.5)))
    w.step()
    deviation = w.sensors.read("imu").std(axis=0)
    np.testing.assert_allclose(deviation, [0.1, 0.1, 0.1, 0.5, 0.5, 0.5], rtol=0.12)


def test_resolution_rounds(world: World) -> None:
    w = world(8, scan=replace(SCAN, noise=0.1, resolution=0.05))
    w.step()
    read = w.sensors.read("scan") / 0.05
    np.testing.assert_allclose(read, np.rint(read), atol=1e-9)
    assert len(np.unique(np.rint(read))) > 2


def test_a_lost_ray_reads_the_maximum(world: World) -> None:
    w = world(N, scan=replace(SCAN, dropout=0.1))
    read = w.watch("scan", 4)
    lost = read == 3.0
    assert lost.mean() == pytest.approx(0.1, abs=5 * (0.09 / lost.size) ** 0.5)
    assert abs(correlation(lost[..., 0], lost[..., 1])) < 0.07  # each ray by itself
    np.testing.assert_allclose(read[~lost], np.broadcast_to(w.robot.lidar("scan"), read.shape)[~lost], atol=1e-3)


def test_a_lost_sample_leaves_the_last_one(world: World) -> None:
    w = world(N, imu=Imu(frame="hull", noise=0.1, dropout=0.25))
    read = w.watch("imu", 6)
    same = read[1:] == read[:-1]
    assert (same.all(axis=-1) == same.any(axis=-1)).all()  # all elements, or none
    stays = same[..., 0]
    assert stays.mean() == pytest.approx(0.25, abs=5 * (0.19 / stays.size) ** 0.5)
    assert np.abs(read[0]).max() > 0  # the first sample is never lost


def test_a_delay_shows_the_sample_of_so_many_steps_ago(world: World) -> None:
    noisy = replace(SCAN, noise=0.02, delay=0.06)
    read = world(N, scan=noisy).watch("scan", 8)
    on_time = world(N, scan=replace(noisy, delay=0.0)).watch("scan", 8)
    np.testing.assert_array_equal(read[3:], on_time[:-3])
    for step in range(3):  # nothing has arrived but the first one
        np.testing.assert_array_equal(read[step], on_time[0])
    assert abs(correlation(read[4:-1], on_time[5:])) < 0.05
    assert correlation(read[4:], on_time[1:-3]) == pytest.approx(1.0)


def test_between_two_samples_the_last_one_stays(world: World) -> None:
    read = world(N, scan=replace(SCAN, noise=0.02, rate=12.5)).watch("scan", 9)  # every 4 steps
    changed = (read[1:] != read[:-1]).all(axis=(1, 2))
    assert changed.tolist() == [step % 4 == 0 for step in range(1, 10)]
    assert ((read[1:] == read[:-1]).all(axis=(1, 2)) == ~changed).all()
    assert abs(correlation(read[0], read[4])) < 0.08


def test_rate_and_delay_go_together(world: World) -> None:
    slow = replace(SCAN, noise=0.02, rate=12.5)
    late = world(4, scan=replace(slow, delay=0.06)).watch("scan", 12)
    np.testing.assert_array_equal(late[3:], world(4, scan=slow).watch("scan", 12)[:-3])


def test_samples_count_from_the_episodes_own_reset(world: World) -> None:
    w = world(2, scan=replace(SCAN, noise=0.02, rate=12.5))
    w.step(3)
    w.reset(np.array([True, False]))
    read = w.watch("scan", 5)
    changed = (read[1:] != read[:-1]).all(axis=-1)
    assert changed[:, 0].tolist() == [False, False, False, True, False]
    assert changed[:, 1].tolist() == [True, False, False, False, True]


def test_a_sensor_that_is_faster_than_the_control_is_read_at_its_newest(world: World) -> None:
    w = world(1, scan=replace(SCAN, rate=100.0))
    assert w.sensors.snapshot() == {}  # as ideal as one without a rate


@pytest.mark.parametrize("rate", [7.0, 75.0])
def test_a_rate_that_does_not_meet_the_control_steps_names_the_nearest(world: World, rate: float) -> None:
    near = {7.0: "6.25 or 7.142857143 Hz", 75.0: "50 or 100 Hz"}[rate]
    with pytest.raises(ConfigurationError, match=f"rate of {rate:g} Hz.*{near}"):
        world(1, scan=replace(SCAN, rate=rate))


def test_a_delay_that_is_no_whole_number_of_steps_names_the_nearest(world: World) -> None:
    with pytest.raises(ConfigurationError, match=r"delay of 0.05 s.*0.04 or 0.06 s"):
        world(1, scan=replace(SCAN, delay=0.05))


def test_a_delay_in_milliseconds_is_rejected_before_its_samples_are_allocated(world: World) -> None:
    world(1, scan=replace(SCAN, delay=20.0))
    with pytest.raises(ConfigurationError, match=r"delay of 2e\+09 s is 100,000,000,000 control steps; at most 1,000"):
        world(1, scan=replace(SCAN, delay=2e9))


def test_unknown_names_are_refused(world: World) -> None:
    w = world(1, scan=SCAN)
    with pytest.raises(UnknownNameError, match="Did you mean 'scan'"):
        w.sensors.read("scam")
    with pytest.raises(UnknownNameError, match="Did you mean 'scan'"):
        Sensors(w.simulation, 0.02, names=["scam"])
    with pytest.raises(UnknownNameError, match="robot"):
        Sensors(w.simulation, 0.02, robot="rabbit")


def test_a_space_has_the_bounds_of_the_reading(world: World) -> None:
    w = world(1, scan=SCAN, bumper=Bumper(frame="hull"))
    assert w.sensors.space("scan").shape == (3,)
    assert w.sensors.space("scan").high[0] == np.float32(3.0)
    assert w.sensors.space("bumper").contains(w.sensors.read("bumper")[0].astype(np.float32))


FAULTY = {
    "scan": replace(SCAN, noise=0.02, delay=0.04, dropout=0.2, resolution=0.01, rate=25.0),
    "imu": Imu(frame="hull", offset=(0.1, 0.0, 0.05), noise=0.1, delay=0.02, dropout=0.2),
    "bumper": Bumper(frame="hull", dropout=0.3),
    "ideal": Imu(frame="hull"),
}


def test_a_snapshot_continues_bit_for_bit(world: World) -> None:
    w, other = world(3, **FAULTY), world(3, seed=9, **FAULTY)
    w.robot.command(np.array([[3.0, 1.0]] * 3))
    w.step(5)
    saved = w.simulation.snapshot(), w.sensors.snapshot(), w.rng.snapshot()
    read = {name: w.sensors.read(name).copy() for name in FAULTY}
    w.step(7)
    later = {name: w.sensors.read(name).copy() for name in FAULTY}
    other.step(3)
    for one in (w, other):
        one.simulation.restore(saved[0])
        one.sensors.restore({"a_task's_own": np.zeros(3), **saved[1]})
        one.rng.restore(saved[2])
        assert all((one.sensors.read(name) == read[name]).all() for name in FAULTY)
        one.step(7)
        assert all((one.sensors.read(name) == later[name]).all() for name in FAULTY)


def test_each_environment_reads_what_it_would_alone(world: World) -> None:
    together = world(3, **FAULTY)
    alone = [world(1, seed=i, **FAULTY) for i in range(3)]
    for w in (together, *alone):
        w.robot.command(np.array([[3.0, 1.0]] * w.robot.num_envs))
        w.step(4)
    together.reset(np.array([False, True, False]))
    alone[1].reset()
    for w in (together, *alone):
        w.step(6)
    for name in FAULTY:
        for i, w in enumerate(alone):
            np.testing.assert_array_equal(together.sensors.read(name)[i], w.sensors.read(name)[0])

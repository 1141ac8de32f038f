"""The clock of paced simulators, with a clock that the test moves."""

from __future__ import annotations

import pytest

from frobs_core.contracts import Pacer


class World:
    """A clock that stands still until somebody sleeps or works."""

    def __init__(self) -> None:
        self.now = 100.0
        self.pacer = Pacer(clock=lambda: self.now, sleep=self.work)

    def work(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def world() -> World:
    return World()


def test_steps_end_at_deadlines_however_long_the_caller_worked(world: World) -> None:
    for k in range(5):
        world.work(0.003 * k)
        world.pacer.wait(0.02)
        if k == 0:
            start = world.now
    assert world.now == pytest.approx(start + 4 * 0.02)
    assert world.pacer.time == pytest.approx([0.1])
    assert (world.pacer.missed, world.pacer.lateness) == (0, 0.0)


@pytest.mark.parametrize(("late", "missed"), [(0.005, 1), (0.019, 1), (0.021, 2), (0.099, 5)])
def test_a_late_step_is_counted_and_ends_at_the_next_deadline(world: World, late: float, missed: int) -> None:
    world.pacer.wait(0.02)
    start = world.now
    world.work(0.02 + late)
    world.pacer.wait(0.02)
    assert world.pacer.missed == missed
    assert world.pacer.lateness == pytest.approx(late)
    assert world.now == pytest.approx(start + (1 + missed) * 0.02)
    assert world.pacer.time == pytest.approx([0.02 + (1 + missed) * 0.02])


def test_what_was_missed_adds_up_until_a_restart(world: World) -> None:
    world.pacer.wait(0.02)
    for _ in range(3):
        world.work(0.03)
        world.pacer.wait(0.02)
    info = world.pacer.info()
    assert info["missed_deadlines"] == [3.0]
    assert info["lateness"] == pytest.approx([0.03])
    world.pacer.restart()
    assert world.pacer.info() == {"missed_deadlines": [0.0], "lateness": [0.0]}
    assert world.pacer.time == [0.0]


def test_the_first_step_cannot_be_late(world: World) -> None:
    world.work(60.0)
    world.pacer.wait(0.02)
    assert world.pacer.missed == 0
    world.pacer.restart()
    world.work(60.0)
    world.pacer.wait(0.02)
    assert world.pacer.missed == 0

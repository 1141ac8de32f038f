"""The robot to check, and the simulator in which it is built."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

from frobs_core.contracts import CommandMode, RobotHandle, Simulation
from frobs_core.description import DriveGains, Placement, Robot, Scene
from frobs_core.models import RobotModel, default_gains, home_positions
from frobs_core.plugins.records import Level, RobotRecord, SimulatorRecord
from frobs_core.sensing.sensors import with_contacts
from frobs_devkit.simulations import simulate


@dataclass(frozen=True)
class RobotUnderTest:
    """A robot and the simulator in which it is built."""

    source: Robot | RobotRecord
    simulator: SimulatorRecord | None = None

    @cached_property
    def robot(self) -> Robot:
        """The robot's description, loaded during the first check so that a broken entry point fails this check."""
        return self.source if isinstance(self.source, Robot) else self.source.load()

    @property
    def model(self) -> RobotModel:
        """The parsed model file."""
        return self.robot.read_model()

    @property
    def gains(self) -> DriveGains:
        """The gains in the robot's description, or default gains computed from the model."""
        return self.robot.gains or default_gains(self.model, home_positions(self.model, self.robot.home))

    @contextmanager
    def build(self, scene: Scene | None = None) -> Iterator[tuple[Simulation, RobotHandle]]:
        """Build and reset a simulation of one robot, and close the simulation at the end of the ``with`` block."""
        assert self.simulator is not None
        placement = Placement(robot=self.robot, model=self.model, command_mode=CommandMode.POSITION)
        scene = scene or Scene()
        if self.simulator.capabilities.get("contacts", Level.UNSUPPORTED):
            scene = with_contacts(scene, {"robot": placement})
        with simulate(self.simulator, placement, scene) as built:
            yield built

"""A paced simulator: the world runs by itself in real time, and FRobs waits for it.

The world is a separate process at the other end of a socket. Replace this process with your robot or your ROS graph. In
this template, the world is an engine that is stepped in real time. The engine's drives follow the received commands,
and hold the last command. The world cannot be paused, saved or duplicated, and its objects cannot be teleported, so the
record does not claim ``pause``, ``teleport``, ``snapshot`` or ``batched``. A reset drives the robots home.

``World`` is the separate process. ``PacedRobot`` and ``MyPacedSimulator`` form the client of this process, and
implement the required methods of a simulator.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from frobs_core.contracts import BodyHandle, CommandMode, Pacer, RobotHandle, Simulation
from frobs_core.description import Placement, Scene, Translation
from frobs_core.models import RobotModel
from frobs_core.plugins import get_record
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.arrays import Floats, Mask, read_only
from frobs_core.util.errors import ConfigurationError, SimulationError

RECORD = SimulatorRecord(
    name="my_paced_simulator",
    summary="a world that runs in real time in a separate process",
    entry_point=f"{__name__}:MyPacedSimulator",
    install_hint="pip install frobs-sim-mujoco",
    capabilities={"real_time": Level.APPROXIMATE, "drive": Level.APPROXIMATE},
)

_HOMING_SPEED = 1.0  # [rad/s or m/s]
_HOMING_PERIOD = 0.02  # [s] time between commands while a robot is driven home
_AT_HOME = 0.05  # [rad or m] maximum deflection under gravity at home, and [rad/s or m/s] maximum residual velocity

Ask = Callable[..., Any]
"""Function that calls a method of the world and returns its result."""


class World:
    """The world: an engine that runs in real time, with drives that follow the last command.

    Args:
        engine: Name of the simulator that runs the world.
        robots: Robots, by name.
        scene: The rest of the scene.
        timestep: Duration of an engine step [s].
    """

    def __init__(self, engine: str, robots: Mapping[str, Placement], scene: Scene, timestep: float) -> None:
        build = get_record("simulator", engine).load()
        self._simulation: Simulation = build(robots, scene, num_envs=1, physics_timestep=timestep)
        self._simulation.reset()
        self._timestep = timestep
        self._rows: dict[str, list[Floats]] = {}

    def set_mode(self, robot: str, modes: Sequence[CommandMode]) -> None:
        """Change the command mode, and hold the current positions, zero velocity or zero effort."""
        self._rows[robot] = []
        self._simulation.robots[robot].set_command_mode(modes)

    def command(self, robot: str, rows: Floats) -> None:
        """Follow the command rows (k, dof), one per step, and then hold the last row."""
        self._rows[robot] = list(rows)

    def read(self) -> dict[str, dict[str, tuple[Floats, ...]]]:
        """Return the current measurements of robots and bodies, by name."""
        sim = self._simulation
        robots: dict[str, tuple[Floats, ...]] = {
            name: (one.joint_positions, one.joint_velocities, one.joint_efforts) for name, one in sim.robots.items()
        }
        return {"robots": robots, "bodies": {name: (*body.pose, *body.twist) for name, body in sim.bodies.items()}}

    def run(self, connection: Connection) -> None:
        """Step in real time, and handle requests between the steps, until the connection closes."""
        due = time.monotonic()
        while True:
            for name, rows in self._rows.items():
                if rows:
                    self._simulation.robots[name].command(rows.pop(0)[None])
            self._simulation.step(1)
            due += self._timestep
            while connection.poll(max(0.0, due - time.monotonic())):
                try:
                    method, arguments = connection.recv()
                    connection.send(getattr(self, method)(*arguments))
                except (EOFError, OSError):
                    return


class PacedRobot(RobotHandle):
    """A robot in the world, as measured at the end of the last step.

    Args:
        name: Name in the simulation.
        placement: Placement of the robot.
        ask: Function that calls a method of the world.
    """

    def __init__(self, name: str, placement: Placement, ask: Ask) -> None:
        if placement.robot.base != "fixed":
            raise ConfigurationError(f"robot '{placement.robot.name}' has a movable base, so it cannot be driven home.")
        self.describe(name, placement, 1)  # sets name, joint names, limits, home and similar attributes
        self._ask = ask
        self.state: tuple[Floats, ...] = ()

    @property
    def joint_positions(self) -> Floats:
        """(1, dof) [rad or m]."""
        return read_only(self.state[0])

    @property
    def joint_velocities(self) -> Floats:
        """(1, dof) [rad/s or m/s]."""
        return read_only(self.state[1])

    @property
    def joint_efforts(self) -> Floats:
        """(1, dof) [N·m or N]."""
        return read_only(self.state[2])

    def set_command_mode(self, mode: CommandMode | Sequence[CommandMode]) -> None:
        """Change the command mode, and hold the current positions, zero velocity or zero effort."""
        self._set_modes(mode)
        self._ask("set_mode", self.name, self.command_modes)

    def command(self, values: Floats) -> None:
        """Set the targets of the drives: (1, dof), or one row for each physics step."""
        self._rows_given = values.shape[1] if values.ndim == 3 else None
        self._ask("command", self.name, values[0] if values.ndim == 3 else values)

    def check_rows(self, decimation: int) -> None:
        """Raise SimulationError if the last command has too few or too many rows for the step."""
        given, self._rows_given = self._rows_given, None
        if given not in (None, decimation):
            raise SimulationError(
                f"the command of robot '{self.name}' has {given} rows, but the step requires {decimation}."
            )

    _rows_given: int | None = None


class PacedBody(BodyHandle):
    """A body in the world, as measured at the end of the last step.

    Args:
        name: Name in the simulation.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.state: tuple[Floats, ...] = ()

    @property
    def pose(self) -> tuple[Floats, Floats]:
        """pos (1, 3) [m] and quat_wxyz (1, 4) in the world frame."""
        return read_only(self.state[0]), read_only(self.state[1])

    @property
    def twist(self) -> tuple[Floats, Floats]:
        """lin_vel_world (1, 3) [m/s] and ang_vel_world (1, 3) [rad/s]."""
        return read_only(self.state[2]), read_only(self.state[3])


class MyPacedSimulator(Simulation):
    """A world that runs in real time in a separate process.

    Args:
        engine: Name of the simulator that runs the world.
        homing_timeout: Maximum time for driving the robots home [s].
    """

    render_modalities = ()

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        engine: str = "mujoco",
        homing_timeout: float = 10.0,
    ) -> None:
        scene.check(robots, lacking=("contacts", "attachments"))
        self.num_envs, self.physics_timestep, self._homing_timeout = num_envs, physics_timestep, homing_timeout
        self.robots = self._robots = {name: PacedRobot(name, one, self._ask) for name, one in robots.items()}
        self.bodies = self._bodies = {name: PacedBody(name) for name in scene.bodies}
        self.pacer = self._pacer = Pacer()
        self._connection, theirs = Pipe()
        number = theirs.fileno()
        self._process = subprocess.Popen([sys.executable, __file__, str(number)], pass_fds=[number])
        theirs.close()
        try:
            self._connection.send((engine, robots, scene, physics_timestep))
            self._read()
        except BaseException:
            self.close()
            raise

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        """Return the default engine's translation of a robot's model file."""
        simulation: type[Simulation] = get_record("simulator", "mujoco").load()
        return simulation.translation(model)

    def _ask(self, method: str, *arguments: Any) -> Any:
        try:
            self._connection.send((method, arguments))
            return self._connection.recv()
        except (EOFError, OSError) as error:
            raise SimulationError(f"the world has ended: {error or 'it closed the connection'}.") from error

    def _read(self) -> None:
        measured = self._ask("read")
        for kind, parts in (("robots", self._robots), ("bodies", self._bodies)):
            for name, part in parts.items():
                part.state = measured[kind][name]

    @property
    def time(self) -> Floats:
        """(1,) [s] since the reset."""
        return read_only(self._pacer.time)

    def reset(self, mask: Mask | None = None) -> None:
        """Drive all robots home, and return when they have stopped there."""
        if mask is None or mask.any():
            self._drive_home()
            self._pacer.restart()

    def _drive_home(self) -> None:
        """Command a motion to the home positions, within the joints' velocity limits.

        Raises:
            SimulationError: The robots do not reach home before the timeout.
        """
        modes = {name: robot.command_modes for name, robot in self._robots.items()}
        for robot in self._robots.values():
            robot.set_command_mode(CommandMode.POSITION)
        self._read()
        targets = {name: robot.joint_positions.copy() for name, robot in self._robots.items()}
        self._pacer.restart()
        while not self._is_home(targets):
            if self._pacer.time[0] > self._homing_timeout:
                raise SimulationError(
                    f"the robots did not reach their home positions within {self._homing_timeout} s of a reset."
                )
            for name, robot in self._robots.items():
                step = _HOMING_PERIOD * np.minimum(_HOMING_SPEED, 0.5 * robot.velocity_limit)
                targets[name] += np.clip(robot.home - targets[name], -step, step)
                robot.command(targets[name])
            self._pacer.wait(_HOMING_PERIOD)
            self._read()
        for name, robot in self._robots.items():
            if modes[name] != robot.command_modes:
                robot.set_command_mode(modes[name])

    def _is_home(self, targets: Mapping[str, Floats]) -> bool:
        return all(
            np.array_equal(targets[name], robot.home)
            and np.abs(robot.joint_positions - robot.home).max(initial=0.0) <= _AT_HOME
            and np.abs(robot.joint_velocities).max(initial=0.0) <= _AT_HOME
            for name, robot in self._robots.items()
        )

    def step(self, decimation: int) -> None:
        """Wait until the world has advanced, and read its state."""
        for robot in self._robots.values():
            robot.check_rows(decimation)
        self._pacer.wait(decimation * self.physics_timestep)
        self._read()

    def close(self) -> None:
        """End the process of the world."""
        self._connection.close()
        self._process.terminate()
        self._process.wait()


if __name__ == "__main__" and len(sys.argv) == 2:  # the process of the world
    other_side = Connection(int(sys.argv[1]))
    World(*other_side.recv()).run(other_side)
    sys.exit()


if __name__ == "__main__":  # python my_paced_simulator.py checks the capabilities that its record declares
    from frobs_devkit.testing import check_simulator, run_checks

    for result in run_checks(check_simulator(RECORD)).results:
        print(result.status, result.name, result.message)

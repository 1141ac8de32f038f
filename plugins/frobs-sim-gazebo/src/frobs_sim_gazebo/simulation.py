"""The Gazebo simulation, which runs one server per environment in lockstep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from frobs_core.contracts import AppliedWrenches, CommandMode, ContactState, Simulation, Snapshot, Stateful, Wrench
from frobs_core.description import Placement, Scene, Translation
from frobs_core.models import RobotModel, pose_array
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import SimulationError, UnknownNameError
from frobs_core.util.rotations import quat_rotate
from frobs_models import read_tables, translate
from frobs_sim_gazebo import protocol
from frobs_sim_gazebo.body import GazeboBody
from frobs_sim_gazebo.fleet import Fleet, Message
from frobs_sim_gazebo.installation import find_gazebo
from frobs_sim_gazebo.layout import Layout
from frobs_sim_gazebo.meshes import MeshFiles
from frobs_sim_gazebo.options import world_text
from frobs_sim_gazebo.parameters import GazeboParameters, centre
from frobs_sim_gazebo.protocol import Op
from frobs_sim_gazebo.robot import GazeboRobot
from frobs_sim_gazebo.server import Server

TABLES = Path(__file__).with_name("translation.yaml")
"""YAML file that describes how each kind of model-file element is translated for Gazebo."""

_MODES = tuple(CommandMode)

FASTEST = 1e6
"""Velocity above which an environment is considered diverged [rad/s or m/s]."""


class GazeboSimulation(Simulation):
    """Simulation of ``num_envs`` copies of robots and a scene, each in a separate Gazebo 11 server.

    For the methods, see :class:`frobs_core.contracts.Simulation`. If a server exits or hangs, the failure is logged,
    the server's environment is marked in :attr:`diverged`, and the next reset starts a new server. Three consecutive
    failures of one environment raise a :class:`~frobs_core.util.errors.SimulationError`. ``num_threads`` has no effect,
    because each server is a process. The solver options configure ODE, Gazebo's physics engine. If an option is None,
    FRobs's default applies.

    Args:
        robots: Robots, by name.
        scene: The rest of the scene.
        num_envs: Number of environments, ≥ 1.
        physics_timestep: [s]
        num_threads: Ignored.
        solver: ODE's solver: ``"world"`` (direct, the default) or ``"quick"`` (iterative).
        iterations: Number of iterations of the ``"quick"`` solver per physics step, ≥ 1.
        cone: Friction cone: ``"pyramidal"`` or ``"elliptic"``.
        erp: Fraction of a constraint's error that is corrected per physics step.
        cfm: Constraint force mixing, which softens constraints, ≥ 0.

    Raises:
        ConfigurationError: The scene is inconsistent, or an option is out of range.
        SimulationError: Gazebo is not installed, or a server does not start.
    """

    render_modalities: ClassVar[Sequence[str]] = ()
    robots: Mapping[str, GazeboRobot]
    bodies: Mapping[str, GazeboBody]

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        solver: str | None = None,
        iterations: int | None = None,
        cone: str | None = None,
        erp: float | None = None,
        cfm: float | None = None,
    ) -> None:
        world = world_text(solver=solver, iterations=iterations, cone=cone, erp=erp, cfm=cfm)
        self.num_envs, self.physics_timestep, self.scene, self.placements = num_envs, physics_timestep, scene, robots
        n = num_envs
        # Report errors in the scene before searching for Gazebo.
        Layout(robots, scene, MeshFiles(None))
        installation = find_gazebo()
        self.layout = layout = Layout(robots, scene, MeshFiles(installation))
        self.version = 0  # incremented with each change of the state, to invalidate cached values
        self.positions, self.velocities, self.efforts = np.zeros((3, n, layout.joint_count))
        self.raw = np.zeros(
            (n, layout.body_count, 13)
        )  # pos, quat_wxyz, linear and angular velocity of the centers of mass
        self.bases = {name: np.tile(layout.start(name), (n, 1)) for name in robots}  # used for robots with a fixed base
        self.stands = {name: np.tile(pose_array(body.pose), (n, 1)) for name, body in scene.bodies.items()}
        self.contacts: ContactState = ContactState(scene, n)
        self.steps, self._diverged = np.zeros(n, np.int64), np.zeros(n, bool)
        self._applied = AppliedWrenches(n)
        self._queues: list[list[Message]] = [[] for _ in range(n)]
        self.stale_gains = np.ones(n, bool)
        self._parted = np.zeros(n, bool)
        self._closed = False
        self.robots = {name: GazeboRobot(self, name, placement) for name, placement in robots.items()}
        self.parameters = GazeboParameters(self)
        self.bodies = {name: GazeboBody(self, name, body) for name, body in scene.bodies.items()}
        self._fleet = Fleet(installation, n, world, self._prepare)
        try:
            self.reset()
        except BaseException:
            self.close()
            raise

    def _prepare(self, server: Server) -> None:
        server.call(Op.SETUP, protocol.numbers([self.physics_timestep, *self.scene.gravity]))
        models = self.layout.models
        spawn = protocol.count(len(models)) + b"".join(protocol.texts(*model) for model in models.items())
        server.call(Op.SPAWN, spawn)
        server.call(Op.LAYOUT, self.layout.message())

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        return translate(model, read_tables(TABLES)[model.format])

    @property
    def native(self) -> tuple[Server | None, ...]:
        """The environments' servers, with None for lost servers."""
        return tuple(self._fleet.server(env) for env in range(self.num_envs))

    @property
    def time(self) -> Floats:
        return np.asarray(self.steps * self.physics_timestep, np.float64)

    @property
    def diverged(self) -> Mask | None:
        """Mask of the environments that have diverged or whose server was lost, or None if no environment failed."""
        return self._diverged if self._diverged.any() else None

    @property
    def wrenches(self) -> Sequence[Wrench]:  # type: ignore[override] # computed here, and never assigned
        """Wrenches that act during the next ``step``."""
        return self._applied.wrenches()

    def reset(self, mask: Mask | None = None) -> None:
        """Reset environments to the scene's initial state, and replace lost servers."""
        self._applied.reset(mask)
        envs = self.envs(mask)
        fresh = [env for env in envs if self._fleet.server(env) is None]
        if self._closed:
            raise SimulationError("the simulation is closed.")
        self._fleet.replace(fresh)
        self._parted[fresh] = False
        self.stale_gains[fresh] = True
        self._diverged[envs] = False
        self.steps[envs] = 0
        self.efforts[envs] = 0.0
        self.contacts.clear(mask)
        for env in envs:
            self._queues[env] = [(Op.CLEAR, b"")]
        for env in fresh:
            self._queues[env] += self.parameters.messages(env)
        for name in self.layout.placed:
            home = pose_array(self.scene.bodies[name].pose)
            self.place(name, np.tile(home, (len(envs), 1)), envs)
        for body in self.bodies.values():
            body.put_home(envs)
        for robot in self.robots.values():
            robot.put_home(envs)
        self._part([env for env in envs if not self._parted[env]])
        for robot in self.robots.values():
            robot.hold(envs)

    def _part(self, envs: Sequence[int]) -> None:
        """Disable collisions between links that overlap at the home position."""
        for name, placement in self.placements.items():
            if placement.robot.self_collision and envs:
                model = protocol.text(self.layout.model_names["robot", name])
                self.exchange({env: [(Op.PART, model)] for env in envs})
        self._parted[list(envs)] = True

    def step(self, decimation: int) -> None:
        if self._closed:
            raise SimulationError("the simulation is closed.")
        self._push()
        envs = np.flatnonzero(~self._diverged).tolist()
        commands = np.zeros((self.num_envs, decimation, self.layout.joint_count))
        for robot in self.robots.values():
            commands[:, :, robot.columns] = robot.take_targets(decimation)
        messages = {}
        for env in envs:
            if self.stale_gains[env]:
                self._queues[env].append((Op.GAINS, self._gains(env)))
                self.stale_gains[env] = False
            messages[env] = [*self._queues[env], (Op.STEP, protocol.step(decimation, commands[env]))]
            self._queues[env] = []
        for env, answer in self.exchange(messages, decimation).items():
            if self._take(env, answer, stepped=True):
                self.steps[env] += decimation

    def _gains(self, env: int) -> bytes:
        gains = np.zeros((self.layout.joint_count, 5))
        for robot in self.robots.values():
            gains[robot.columns] = robot.drive_parameters(env)
        return protocol.numbers(gains)

    def _take(self, env: int, answer: bytes, *, stepped: bool = False) -> bool:
        """Store the state in a server's answer, and return whether the state is valid.

        The efforts and contacts in the answer are stored only after a step.
        """
        self.version += 1
        numbers, joints, bodies = protocol.read_numbers(answer), self.layout.joint_count, self.layout.body_count
        if numbers[0]:
            self._diverged[env] = True
            return False
        by_joint = numbers[1 : 1 + 3 * joints].reshape(joints, 3)
        self.positions[env], self.velocities[env], efforts = by_joint.T
        contacts = 1 + 3 * joints + 13 * bodies
        self.raw[env] = numbers[1 + 3 * joints : contacts].reshape(bodies, 13)
        if stepped:
            self.efforts[env] = efforts
            by_contact = numbers[contacts:].reshape(-1, 5)
            self.contacts.closed[env], self.contacts.normal_force[env] = by_contact[:, :2].T
            self.contacts.resultant[env] = by_contact[:, 2:]
        return True

    def exchange(self, messages: Mapping[int, Sequence[Message]], steps: int = 0) -> dict[int, bytes]:
        """Send messages to environments, and return the answer to each environment's last message.

        Environments without a server are marked as diverged.
        """
        if self._closed:
            raise SimulationError("the simulation is closed.")
        answers = self._fleet.exchange(messages, steps)
        lost = [env for env in messages if env not in answers]
        self._diverged[lost] = True
        return answers

    def is_sound(self, env: int) -> bool:
        """Return whether an environment has not diverged."""
        return not self._diverged[env]

    def origin_state(self, body: int) -> tuple[Floats, Floats]:
        """Return the pose, (num_envs, 7), and the twist, (num_envs, 6), of a moving body's origin in the world frame."""
        pos, quat, linear, angular = np.split(self.raw[:, body], (3, 7, 10), axis=1)
        arm = quat_rotate(quat, self.layout.coms[body])
        return np.concatenate([pos - arm, quat], 1), np.concatenate([linear - np.cross(angular, arm), angular], 1)

    def later(self, env: int, op: Op, body: bytes) -> None:
        """Queue a message that is sent before the next step, state change or ray cast. The answer is discarded."""
        self._queues[env].append((op, body))

    def write(self, bodies: slice, raw: Floats, envs: Sequence[int], joints: slice, positions: Floats) -> None:
        """Teleport bodies.

        Args:
            bodies: Index range of the bodies.
            raw: State of each body at its center of mass: position, quat_wxyz, linear velocity and angular velocity,
                (k, bodies, 13).
            envs: Indices of the k environments.
            joints: Index range of the joints that move with the bodies.
            positions: Positions of these joints, (k, joints) [rad or m].
        """
        messages = {}
        for row, env in enumerate(envs):
            sound = np.isfinite(raw[row]).all() and np.abs(raw[row, :, 7:]).max(initial=0.0) < FASTEST
            if not sound:
                self._diverged[env] = True  # Gazebo cannot handle NaN, infinity or very high velocities
            if self._diverged[env]:
                continue
            angles = np.full(self.layout.joint_count, np.nan)
            angles[joints] = positions[row]
            body = protocol.count(bodies.stop - bodies.start)
            for number, values in zip(range(bodies.start, bodies.stop), raw[row], strict=True):
                body += protocol.count(number) + protocol.numbers(values)
            messages[env] = [*self._queues[env], (Op.WRITE, body + protocol.numbers(angles))]
            self._queues[env] = []
        for env, answer in self.exchange(messages).items():
            self._take(env, answer)

    def place(self, body: str, poses: Floats, envs: Sequence[int]) -> None:
        """Teleport a kinematic body to poses (k, 7) in k environments."""
        model = protocol.text(self.layout.model_names["body", body])
        for pose, env in zip(poses, envs, strict=True):
            if (self.stands[body][env] != pose).any():
                self.stands[body][env] = pose
                self.later(env, Op.PLACE, model + protocol.numbers(pose))
        self.version += 1

    def rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str = "") -> Floats:
        if exclude and exclude not in self.robots:
            raise UnknownNameError("robot of the simulation", exclude, self.robots)
        count = origins.shape[1]
        head = protocol.count(count) + protocol.numbers(max_range)
        head += protocol.text(self.layout.model_names["robot", exclude] if exclude else "")
        messages = {}
        for env in np.flatnonzero(~self._diverged).tolist():
            body = head + protocol.numbers(origins[env]) + protocol.numbers(directions[env])
            messages[env] = [*self._queues[env], (Op.RAYS, body)]
            self._queues[env] = []
        distances = np.full((self.num_envs, count), max_range)
        for env, answer in self.exchange(messages).items():
            distances[env] = protocol.read_numbers(answer)
        return distances

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        self.parameters.check_body(body)
        self._applied.add(body, force_world, torque_world, mask)

    def _push(self) -> None:
        """Queue the wrenches that act during the next step."""
        for body, forces, torques, mask in self.wrenches:
            number, point = centre(self, body)
            if number is None:
                continue  # the body is fixed
            for env, force, torque in zip(self.envs(mask), forces, torques, strict=True):
                self.later(env, Op.PUSH, protocol.count(number) + protocol.numbers([*point, *force, *torque]))
        self._applied.clear()

    def parameter(self, name: str, target: str = "") -> Floats:
        return self.parameters.read(name, target)

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        self.parameters.write(name, target, values, mask)

    def stored_arrays(self) -> Snapshot:
        state = {name: getattr(self, name) for name in ("positions", "velocities", "efforts", "raw", "steps")}
        return {**state, "diverged": self._diverged, **{f"stands/{name}": poses for name, poses in self.stands.items()}}

    def stored_parts(self) -> Mapping[str, Stateful]:
        return {"contacts": self.contacts, **{f"robots/{name}": robot for name, robot in self.robots.items()}}

    def snapshot(self) -> Snapshot:
        """Return poses, velocities, drive targets, and the written parameters."""
        modes = {
            f"modes/{name}": np.tile([_MODES.index(mode) for mode in robot.command_modes], (self.num_envs, 1))
            for name, robot in self.robots.items()
        }
        return {**super().snapshot(), **modes, **self._applied.snapshot(), **self.parameters.snapshot()}

    def restore(self, snapshot: Snapshot) -> None:
        self.reset(self._diverged | np.array([server is None for server in self.native], bool))
        self.parameters.restore(snapshot)
        self._applied.restore(snapshot)
        envs = range(self.num_envs)
        for name, robot in self.robots.items():
            robot.set_command_mode([_MODES[int(number)] for number in snapshot[f"modes/{name}"][0]])
        for name in self.layout.placed:
            self.place(name, snapshot[f"stands/{name}"], envs)
        bodies, joints = slice(0, self.layout.body_count), slice(0, self.layout.joint_count)
        self.write(bodies, snapshot["raw"], envs, joints, snapshot["positions"])
        super().restore(snapshot)
        self.stale_gains[:] = True
        self.version += 1

    def close(self) -> None:
        """Stop the servers. Repeated calls have no effect."""
        if not self._closed:
            self._closed = True
            self._fleet.close()

    def envs(self, mask: Mask | None) -> list[int]:
        """Return the indices of the environments that a mask selects."""
        return list(range(self.num_envs)) if mask is None else np.flatnonzero(mask).tolist()

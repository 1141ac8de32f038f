"""The PyBullet simulation, with one physics server per environment, in this process or in worker processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from frobs_core.contracts import AppliedWrenches, ContactState, Simulation, Snapshot, Wrench
from frobs_core.description import Marker, Overlap, Placement, Scene, Translation
from frobs_core.models import RobotModel
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError, SimulationError, UnknownNameError, check_name
from frobs_models import read_tables, translate
from frobs_sim_pybullet import layout
from frobs_sim_pybullet.bare import BarePybullet
from frobs_sim_pybullet.block import Block
from frobs_sim_pybullet.body import PybulletBody
from frobs_sim_pybullet.looks import Looks
from frobs_sim_pybullet.options import Engine, read_options
from frobs_sim_pybullet.overlaps import find_overlaps
from frobs_sim_pybullet.parameters import PybulletParameters
from frobs_sim_pybullet.pool import CONTEXT, Pool, count_workers
from frobs_sim_pybullet.rendering import Renderer, Viewer
from frobs_sim_pybullet.robot import PybulletRobot
from frobs_sim_pybullet.transforms import IDENTITY, Quat, Vector

TABLES = Path(__file__).with_name("translation.yaml")
"""YAML file that describes how each kind of model-file element is translated."""


class Native(NamedTuple):
    """PyBullet's client and body indices in one environment.

    Attributes:
        client: Client of the environment's physics server.
        robots: Body index of each robot, by name.
        bodies: Body index of each scene body, by name.
    """

    client: int
    robots: dict[str, int]
    bodies: dict[str, int]


class PybulletSimulation(Simulation):
    """Simulation of ``num_envs`` copies of robots and a scene in PyBullet.

    For the methods, see :class:`frobs_core.contracts.Simulation`. With a single environment or ``num_threads=1``, the
    simulation runs in this process. Otherwise, the environments are distributed among this process and worker
    processes. If an option of the engine is None, Bullet's default applies.

    Args:
        robots: Robots, by name.
        scene: The rest of the scene.
        num_envs: Number of environments, ≥ 1.
        physics_timestep: [s]
        num_threads: Maximum number of processes, including this process, or 0 for one per processor.
        cone: Friction cone: ``"pyramidal"`` or ``"elliptic"``.
        iterations: Maximum number of constraint solver iterations per physics step, ≥ 1.
        tolerance: Residual below which the constraint solver stops, ≥ 0.
        erp: Fraction of a joint's constraint error that is corrected per physics step.
        contact_erp: Fraction of a contact's penetration that is corrected per physics step.
        friction_erp: Fraction of a friction anchor's error that is corrected per physics step.
        cfm: Constraint force mixing, which softens constraints, ≥ 0.

    Raises:
        ConfigurationError: The scene is inconsistent, or an option is out of range.
    """

    robots: Mapping[str, PybulletRobot]
    bodies: Mapping[str, PybulletBody]

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        cone: str | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        erp: float | None = None,
        contact_erp: float | None = None,
        friction_erp: float | None = None,
        cfm: float | None = None,
    ) -> None:
        self.engine = Engine(physics_timestep, read_options(locals()))
        self.num_envs, self.physics_timestep, self.scene = num_envs, physics_timestep, scene
        self.placements = robots
        scene.check(robots)
        workers = count_workers(num_envs, num_threads)
        fields = layout.layout(robots, scene)
        buffer = layout.allocate(fields, num_envs, CONTEXT if workers > 1 else None)
        self.arrays = layout.arrays(fields, num_envs, buffer)
        self.contacts: ContactState = ContactState(scene, num_envs, self.arrays)
        self.sensor_wrenches = {
            f"{name}/{sensor}": self.arrays[f"robots/{name}/wrench/{sensor}"]
            for name, placement in robots.items()
            for sensor in placement.force_torque_sensors
        }
        self.robots = {name: PybulletRobot(self, name, placement) for name, placement in robots.items()}
        self.bodies = {name: PybulletBody(self, name, body) for name, body in scene.bodies.items()}
        self._backend: Block | Pool
        if workers == 1:
            self._backend = Block(robots, scene, self.engine, self.arrays, range(num_envs))
        else:
            self._backend = Pool(robots, scene, self.engine, fields, num_envs, buffer, workers)
        self.command_rows: dict[str, Floats] = {}
        self._applied = AppliedWrenches(num_envs)
        self.looks = Looks(num_envs, scene, lambda: self._drawing().stage)
        self.parameters = PybulletParameters(self)
        self._seen: dict[str, Floats] = {}
        self._diverged = self.arrays["diverged"]
        self._sound = self._diverged.tobytes()
        self._renderer: Renderer | None = None
        self._viewer: Viewer | None = None
        self._closed = False
        self.reset()

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        return translate(model, read_tables(TABLES)[model.format])

    @property
    def native(self) -> tuple[Native, ...]:
        """PyBullet's indices of robots and bodies, as one :class:`Native` per environment.

        Raises:
            SimulationError: The environments are in worker processes, which the caller cannot access.
        """
        if not isinstance(self._backend, Block):
            raise SimulationError(
                "the environments run in worker processes; create the simulation with num_threads=1 to access them in "
                "this process."
            )
        self.call("apply_sizes", None)
        worlds = self._backend.worlds.values()
        return tuple(Native(w.client, {n: r.body for n, r in w.robots.items()}, dict(w.bodies)) for w in worlds)

    @property
    def time(self) -> Floats:
        return self.arrays["time"]

    @property
    def diverged(self) -> Mask | None:
        return None if self._diverged.tobytes() == self._sound else self._diverged

    @property
    def wrenches(self) -> Sequence[Wrench]:  # type: ignore[override] # computed here, and never assigned
        """Wrenches that act during the next ``step``."""
        return self._applied.wrenches()

    def reset(self, mask: Mask | None = None) -> None:
        self._applied.reset(mask)
        self.call("reset", mask)
        self.contacts.clear(mask)
        for robot in self.robots.values():
            robot.hold(slice(None) if mask is None else np.flatnonzero(mask))
        self.command_rows.clear()

    def step(self, decimation: int) -> None:
        if self._closed:
            raise SimulationError("the simulation is closed.")
        for body, force, torque, mask in self.wrenches:
            self.call("push", mask, body, force, torque)
        self._applied.clear()
        rows = self.command_rows
        if rows:
            for values in rows.values():
                if values.shape[1] != decimation:
                    raise ConfigurationError(
                        f"a command has {values.shape[1]} rows, but the step has {decimation} physics steps; pass one "
                        "row per physics step."
                    )
            self._backend.step(decimation, rows)
            for name, values in rows.items():
                self.arrays[f"robots/{name}/command"][:] = values[:, -1]
            rows.clear()
        else:
            self._backend.step(decimation, rows)
        if self._viewer is not None:
            self._viewer.sync(self.arrays, self.parameters.sizes(0))

    def rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str = "") -> Floats:
        if exclude and exclude not in self.robots:
            raise UnknownNameError("robot of the simulation", exclude, self.robots)
        ends = origins.shape[1:]
        return np.array(self.call("rays", None, (origins, ends), (directions, ends), max_range, exclude))

    def write_body_poses(
        self, names: Sequence[str], pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None
    ) -> None:
        if not all(self.bodies[name].moves for name in names):
            super().write_body_poses(names, pos, quat_wxyz, mask)  # raises an error with the name of the static body
            return
        quats = () if quat_wxyz is None else ((quat_wxyz, (len(names), 4)),)
        self.call("write_bodies", mask, list(names), (pos, (len(names), 3)), *quats)

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        self.parameters.check_body(body)
        self._applied.add(body, force_world, torque_world, mask)

    def parameter(self, name: str, target: str = "") -> Floats:
        return self.parameters.read(name, target)

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        self.parameters.write(name, target, values, mask)

    def parameter_targets(self, name: str) -> Sequence[str]:
        if name in Looks.names:
            return self.looks.targets(name)
        return self.scene.sizable_bodies if name == "size" else super().parameter_targets(name)

    def snapshot(self) -> Snapshot:
        saved = self.call("save", None)
        longest = max(map(len, saved))
        state = {name: self.arrays[name].copy() for name in layout.state_names(self.arrays)}
        state["bullet"] = np.stack([np.pad(row, (0, longest - len(row))) for row in saved])
        state["bullet_bytes"] = np.array([len(row) for row in saved])
        return {**state, **self._applied.snapshot(), **self.parameters.snapshot()}

    def restore(self, snapshot: Snapshot) -> None:
        self.parameters.restore(snapshot)
        self._applied.restore(snapshot)
        for name in layout.state_names(self.arrays):
            self.arrays[name][...] = snapshot[name]
        steps = np.rint(snapshot["time"] / self.physics_timestep).astype(np.int64)
        sizes, saved = snapshot["bullet_bytes"], snapshot["bullet"]
        self.call("load", None, saved, sizes, steps, self._diverged.copy())
        for name in layout.state_names(self.arrays):
            self.arrays[name][...] = snapshot[name]
        self.command_rows.clear()

    def render(
        self,
        mask: Mask | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (480, 640),
        modality: str = "rgb",
        markers: Sequence[Marker] = (),
        fast: bool = False,
    ) -> np.ndarray[Any, Any]:
        if camera is not None and camera not in self.scene.cameras:
            raise UnknownNameError("camera", camera, self.scene.cameras)
        check_name("modality", modality, self.render_modalities)
        name = camera or next(iter(self.scene.cameras), None)
        self._watch_what_is_drawn()
        renderer = self._drawing()
        chosen = list(range(self.num_envs)) if mask is None else np.flatnonzero(mask).tolist()
        pictures = [
            renderer.draw(
                self.arrays, i, self.parameters.sizes(i), name, self._frame(name, i), size, modality, markers, fast
            )
            for i in chosen or [0]  # even an empty result requires one image to determine its shape and dtype
        ]
        return np.stack(pictures)[: len(chosen)]

    def _drawing(self) -> Renderer:
        if self._renderer is None:
            self._renderer = Renderer(self.placements, self.scene, self.looks)
        return self._renderer

    def open_viewer(self) -> None:
        self._watch_what_is_drawn()
        if self._viewer is None:
            self._viewer = Viewer(self.placements, self.scene, self.looks)
        self._viewer.sync(self.arrays, self.parameters.sizes(0))

    def _watch_what_is_drawn(self) -> None:
        for robot in self.robots.values():
            _ = robot.base_pose
        for body in self.bodies.values():
            _ = body.pose

    def _frame(self, camera: str | None, env: int) -> tuple[Vector, Quat]:
        """Return the world pose of the frame to which a camera is fixed."""
        frame = None if camera is None else self.scene.cameras[camera].frame
        if frame is None:
            return IDENTITY
        robot, _, link = frame.partition("/")
        pose = self.bodies[frame].pose if frame in self.bodies else self.robots[robot].frame_pose(link)
        pos, (w, x, y, z) = pose[0][env].tolist(), pose[1][env].tolist()
        return tuple(pos), (x, y, z, w)

    def overlaps(self, robot: str = "robot") -> Sequence[Overlap]:
        """Return a robot's overlapping link pairs in the first environment, with the deepest overlap first.

        Link pairs that overlap at the home position are included, although they never collide in the simulation.
        """
        check_name("robot of the simulation", robot, self.robots)
        return find_overlaps(self.placements[robot], self.robots[robot].joint_positions[0])

    def bare_engine(self) -> BarePybullet | None:
        return BarePybullet(self) if BarePybullet.knows(self) else None

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            for resource in (self._renderer, self._viewer):
                if resource is not None:
                    resource.close()
            self._renderer = self._viewer = None
            self._backend.close()

    def count(self, mask: Mask | None) -> int:
        """Return the number of environments that a mask selects."""
        return self.num_envs if mask is None else int(np.count_nonzero(mask))

    def call(self, method: str, mask: Mask | None, *arguments: Any) -> list[Any]:
        """Call a method on the worlds selected by ``mask``.

        Args:
            method: Name of a method of :class:`frobs_sim_pybullet.editing.EditableWorld`.
            mask: Mask of the environments.
            *arguments: Arguments of the method. An array must have one row per selected environment. A tuple (values,
                shape of a row) is broadcast to one row per selected environment. Other arguments are passed unchanged.
        """
        if self._closed:
            raise SimulationError("the simulation is closed.")
        ids = range(self.num_envs) if mask is None else np.flatnonzero(mask).tolist()
        rows = [
            np.broadcast_to(np.asarray(given[0], np.float64), (len(ids), *given[1])).copy()
            if isinstance(given, tuple)
            else given
            for given in arguments
        ]
        return self._backend.call(method, ids, rows)

    def watched(self, channel: str) -> Floats:
        """Return a read-only view of a shared array, and keep the array up to date from now on."""
        view = self._seen.get(channel)
        if view is None:
            self.call("watch", None, channel)
            view = self._seen[channel] = self.arrays[channel].view()
            view.flags.writeable = False
        return view

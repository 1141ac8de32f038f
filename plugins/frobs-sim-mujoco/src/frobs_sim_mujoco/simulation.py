"""The MuJoCo simulation, which steps a batch of states in native threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch

from frobs_core.contracts import AppliedWrenches, ContactState, Simulation, Snapshot, Wrench
from frobs_core.description import Marker, Overlap, Placement, Scene, Translation
from frobs_core.models import RobotModel
from frobs_core.util.arrays import Floats, Mask
from frobs_core.util.errors import ConfigurationError, SimulationError, UnknownNameError, check_name
from frobs_models import read_tables, translate
from frobs_sim_mujoco import parameters
from frobs_sim_mujoco.body import MujocoBody
from frobs_sim_mujoco.building import build_model
from frobs_sim_mujoco.columns import columns_of, numbers_of, put
from frobs_sim_mujoco.contacts import ContactReader
from frobs_sim_mujoco.geoms import ROBOT_GROUPS, seen_except
from frobs_sim_mujoco.kinematics import Kinematics
from frobs_sim_mujoco.looks import Looks
from frobs_sim_mujoco.mjcf import Mjcf, write_mjcf
from frobs_sim_mujoco.options import read_options
from frobs_sim_mujoco.overlaps import find_overlaps
from frobs_sim_mujoco.rendering import Drawn, RenderPool, Viewer
from frobs_sim_mujoco.robot import MujocoRobot
from frobs_sim_mujoco.wrenches import WrenchReader

_VEL = int(mujoco.mjtStage.mjSTAGE_VEL)
_NONE = int(mujoco.mjtStage.mjSTAGE_NONE)
_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
_CTRL = int(mujoco.mjtState.mjSTATE_CTRL)
_DIVERGED = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)
_STATES = ("time", "qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat", "xfrc_applied")
TABLES = Path(__file__).with_name("translation.yaml")
"""YAML file that describes how each kind of model-file element is translated."""


class Native(NamedTuple):
    """MuJoCo's own objects.

    Attributes:
        model: The compiled model.
        batch: Batch of states, with one row per environment.
    """

    model: mujoco.MjModel
    batch: Batch


class BareMujoco:
    """Minimal MuJoCo loop for benchmarks: ``mj_step`` for one environment, or ``Batch.step`` for several environments.

    Args:
        model: The compiled model.
        num_envs: Number of environments. Several environments run in a batch.
        num_threads: Number of threads for the batch.
    """

    def __init__(self, model: mujoco.MjModel, num_envs: int, num_threads: int) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._batch = None if num_envs == 1 else Batch(model, num_envs, num_threads)

    def load(self, snapshot: Snapshot) -> None:
        """Load the states and the controls from a snapshot."""
        if self._batch is None:
            mujoco.mj_setState(self._model, self._data, snapshot["state"][0], mujoco.mjtState.mjSTATE_INTEGRATION)
        else:
            self._batch.state[:] = snapshot["state"]

    def step(self, decimation: int) -> None:
        """Advance by ``decimation`` physics steps."""
        if self._batch is None:
            mujoco.mj_step(self._model, self._data, decimation)
        else:
            self._batch.step(nstep=decimation)

    def rays(self, origins: Floats, directions: Floats, max_range: float) -> None:
        """Cast rays from one point per environment, ignoring the first robot, like a lidar on that robot."""
        if self._batch is None:
            k = directions.shape[1]
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_multiRay(
                self._model,
                self._data,
                origins[0, 0],
                directions[0].ravel(),
                seen_except(ROBOT_GROUPS[0]),
                True,
                -1,
                np.empty(k, np.int32),
                np.empty(k),
                None,
                k,
                max_range,
            )
        else:
            self._batch.ray(origins, directions, geomgroup=seen_except(ROBOT_GROUPS[0]))


class MujocoSimulation(Simulation):
    """Simulation of ``num_envs`` copies of robots and a scene in MuJoCo. See :class:`frobs_core.contracts.Simulation`.

    The solver options have the same names as in MuJoCo's ``mjOption``. If an option is None, MuJoCo's default applies,
    except for the integrator.

    Args:
        robots: Robots, by name.
        scene: The rest of the scene.
        num_envs: Number of environments, ≥ 1.
        physics_timestep: [s]
        num_threads: Number of threads for the batch, or 0 for one per processor.
        solver: Constraint solver: ``"newton"``, ``"cg"`` or ``"pgs"``.
        cone: Friction cone: ``"pyramidal"`` or ``"elliptic"``.
        integrator: ``"implicitfast"`` or ``"discrete"``. ``"discrete"`` is about 5 % slower, and more accurate if robots
            with strong drives touch objects. If None, ``"discrete"`` is used for scenes with
            ``hard_contacts``, and ``"implicitfast"`` for all other scenes.
        impratio: Ratio of frictional to normal constraint impedance for elliptic cones, > 0.
        density: Density of the surrounding medium [kg/m³], ≥ 0, for example 1.2 for air or 1000 for water.
        viscosity: Viscosity of the surrounding medium [Pa·s], ≥ 0.
        wind: Velocity of the surrounding medium in the world frame, three numbers [m/s].
        iterations: Maximum number of solver iterations per physics step, ≥ 1.
        tolerance: Improvement per iteration below which the solver stops, ≥ 0.
        ls_iterations: Maximum number of line-search iterations, ≥ 1.
        ls_tolerance: Gradient below which the line search stops, ≥ 0.
        noslip_iterations: Number of iterations of the no-slip solver, which runs after the main solver. A value of 0
            disables the no-slip solver.
        noslip_tolerance: Improvement per iteration below which the no-slip solver stops, ≥ 0.
        ccd_iterations: Maximum number of iterations of the collision detection between convex shapes, ≥ 1.
        ccd_tolerance: Improvement per iteration below which the collision detection between convex shapes stops, ≥ 0.

    Raises:
        ConfigurationError: The scene is inconsistent, or an option is out of range.
        ModelFileError: MuJoCo cannot compile a robot's model.
    """

    robots: Mapping[str, MujocoRobot]
    bodies: Mapping[str, MujocoBody]
    sensor_wrenches: Mapping[str, Floats]

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        *,
        num_envs: int,
        physics_timestep: float,
        num_threads: int = 0,
        solver: str | None = None,
        cone: str | None = None,
        integrator: str | None = None,
        impratio: float | None = None,
        density: float | None = None,
        viscosity: float | None = None,
        wind: Sequence[float] | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        ls_iterations: int | None = None,
        ls_tolerance: float | None = None,
        noslip_iterations: int | None = None,
        noslip_tolerance: float | None = None,
        ccd_iterations: int | None = None,
        ccd_tolerance: float | None = None,
    ) -> None:
        self._options = read_options(locals())
        _leave_no_log_file()
        self.num_envs = num_envs
        self.physics_timestep = physics_timestep
        self.scene = scene
        self._placements = robots
        self.model = self._build_model()
        # With a single environment, the batch stores derived quantities, so that the next step does not recompute them.
        # With several environments, storing these quantities would require one MjData per environment, which costs more
        # memory and time than it saves.
        self.batch = Batch(self.model, num_envs, 1 if num_envs == 1 else num_threads, persistent=num_envs == 1)
        self._num_threads = num_threads
        self._warnings = self.batch.warning[:, _DIVERGED, 1]
        self._no_warnings = self._warnings.tobytes()
        self.body_ids = {self.model.body(i).name: i for i in range(1, self.model.nbody)}
        self._everywhere = np.ones(num_envs, np.bool_)
        self.stale: Mask | None = None  # environments whose derived values must be recomputed before they are read
        self._stale_constants: Mask | None = None
        self._derived: dict[str, Floats] = {}
        self._applied = AppliedWrenches(num_envs)
        self._rows: Floats | None = None
        # These views of the states are bound only once, because binding takes 10 µs and the arrays are never
        # reallocated.
        self.states = {name: self.batch.bind(name) for name in _STATES}
        # The last step's efforts are copied, because after a write, MuJoCo recomputes derived values without efforts.
        self._actuator_force = self.batch.bind("actuator_force")
        self.efforts = np.zeros((num_envs, self.model.nu))
        self._contact_reader = ContactReader(self.model, scene)
        self.contacts: ContactState = ContactState(scene, num_envs)
        self._wrench_reader = WrenchReader(self.model, robots)
        self.sensor_wrenches = {name: np.zeros((num_envs, 6)) for name in self._wrench_reader.names}
        self._records: dict[int, Any] = {}  # reusable rollout arrays, by number of physics steps
        self._recorded_fields: tuple[str, ...] = ("sensordata",)
        if self.sensor_wrenches:
            self._recorded_fields += self._wrench_reader.fields
        self._senses = bool(scene.contacts or self.sensor_wrenches)
        # A recorded step does not compute derived values. For one environment, Kinematics computes them faster than the
        # batch.
        self._kinematics = Kinematics(self.batch) if num_envs == 1 and self._senses else None
        # Poses and velocities do not depend on contacts. If bodies can touch, several environments compute them faster
        # in a pass without contacts than in the last stage of a step.
        separate = num_envs > 1 and bool(scene.bodies)
        self._disabled = self.batch.expand("opt.disableflags") if separate else np.zeros(0, np.int32)
        self._disabled_by_model = self._disabled.copy()
        self._stage = _NONE if separate else _VEL
        self._renderer: RenderPool | None = None
        self._draws_scenery = False
        self._mocaps: dict[tuple[str, ...], slice | np.ndarray | None] = {}
        around = [body.pose.pos[:2] for body in scene.bodies.values()] or [
            placement.pose.pos[:2] for placement in robots.values()
        ]
        self.looks = Looks(num_envs, lambda: self._build_model(visuals=True), np.mean(around or [(0.0, 0.0)], axis=0))
        self.sizes: dict[str, Floats] = {}  # size factors of resized bodies, (num_envs,) each
        self._viewer: Viewer | None = None
        self._closed = False

        self.robots = {
            name: MujocoRobot(self, name, placement, ROBOT_GROUPS[min(number, len(ROBOT_GROUPS) - 1)])
            for number, (name, placement) in enumerate(robots.items())
        }
        self.bodies = {name: MujocoBody(self, name, body) for name, body in scene.bodies.items()}
        for robot in self.robots.values():
            robot.go_home()
        for body in self.bodies.values():
            body.start()
        self._initial = self.batch.state.copy()
        self.stale = self._everywhere

    @classmethod
    def translation(cls, model: RobotModel) -> Sequence[Translation]:
        return translate(model, read_tables(TABLES)[model.format])

    @property
    def native(self) -> Native:
        """The compiled MuJoCo model and the batch of states."""
        return Native(self.model, self.batch)

    @property
    def time(self) -> Floats:
        return np.asarray(self.states["time"])

    @property
    def diverged(self) -> Mask | None:
        """Mask of the environments whose state MuJoCo could not advance, or None if MuJoCo could advance all states."""
        if self._warnings.tobytes() == self._no_warnings:
            return None
        return np.asarray(self._warnings.any(axis=1))

    @property
    def wrenches(self) -> Sequence[Wrench]:  # type: ignore[override] # computed here, and never assigned
        """Wrenches that act during the next ``step``."""
        return self._applied.wrenches()

    def reset(self, mask: Mask | None = None) -> None:
        self._check_open()
        self._applied.reset(mask)
        ids = None if mask is None else np.flatnonzero(mask)
        self.batch.reset(ids, stage=_NONE)
        rows = slice(None) if ids is None else ids
        self.batch.state[rows] = self._initial[rows]
        self.contacts.clear(mask)
        self.efforts[rows] = 0.0
        for wrench in self.sensor_wrenches.values():
            wrench[rows] = 0.0
        for robot in self.robots.values():
            if robot.gains_written:  # the initial state's controls are only valid for the initial gains
                robot.hold_home(rows)
        self.mark_stale(mask)

    def step(self, decimation: int) -> None:
        if self._closed:
            raise SimulationError("the simulation is closed.")
        if self._stale_constants is not None:
            self._set_constants()
        if self._applied:
            for name, wrench in self._applied.items():
                self.states["xfrc_applied"][:, self.body_ids[name]] = wrench
        if self._rows is None and not self._senses:
            self.batch.step(nstep=decimation, stage=self._stage)
            self.stale = None if self._stage == _VEL else self._everywhere
            self.efforts[:] = self._actuator_force
        else:
            self._step_recorded(decimation)
        if self._applied:
            self.states["xfrc_applied"][:] = 0.0
            self._applied.clear()
        if self._viewer is not None:
            self._viewer.sync()

    def _step_recorded(self, decimation: int) -> None:
        """Advance with separate controls for each physics step, or while recording contacts and forces."""
        rows = self._rows
        if rows is not None and rows.shape[1] != decimation:
            raise ConfigurationError(
                f"a command has {rows.shape[1]} rows, but the step has {decimation} physics steps; pass one row per "
                "physics step."
            )
        before = self.states["qvel"].copy() if self.sensor_wrenches else None
        buffers = self._records.get(decimation)
        recorded = self.batch.rollout(
            decimation, control=rows, control_spec=_CTRL, record=self._recorded_fields, out=buffers
        )
        self._records[decimation] = recorded
        self._rows = None
        self.efforts[:] = self._actuator_force
        self.stale = self._everywhere  # derived values are computed when read, because tasks may move bodies first
        if self.scene.contacts:
            self._contact_reader.read(recorded["sensordata"], self.contacts)
        if before is not None:
            for name, wrench in self._wrench_reader.read(recorded, before).items():
                self.sensor_wrenches[name][:] = wrench

    def rays(self, origins: Floats, directions: Floats, max_range: float, exclude: str = "") -> Floats:
        if exclude and exclude not in self.robots:
            raise UnknownNameError("robot of the simulation", exclude, self.robots)
        seen = self.robots[exclude].seen if exclude else seen_except()
        return self.cast(origins, directions, max_range, seen)

    def cast(
        self, origins: Floats, directions: Floats, max_range: float, seen: np.ndarray, *, from_one_point: bool = False
    ) -> Floats:
        """Cast rays against the geom groups in the mask ``seen`` and return the distances, (num_envs, k) [m]."""
        if from_one_point and self._kinematics is not None:
            self.refresh()
            return self._kinematics.rays(origins[0, 0], directions[0], max_range, seen)
        distances, _ = self.batch.ray(origins, directions, geomgroup=seen)
        return np.where((distances < 0) | (distances > max_range), max_range, distances)

    def write_body_poses(
        self, names: Sequence[str], pos: Floats, quat_wxyz: Floats | None = None, mask: Mask | None = None
    ) -> None:
        columns = self._mocap_columns(tuple(names))
        if columns is None:  # some are free or static
            super().write_body_poses(names, pos, quat_wxyz, mask)
            return
        rows = numbers_of(mask)
        put(self.states["mocap_pos"], rows, columns, pos)
        if quat_wxyz is not None:
            put(self.states["mocap_quat"], rows, columns, quat_wxyz)
        self.mark_stale(mask)

    def _mocap_columns(self, names: tuple[str, ...]) -> slice | np.ndarray | None:
        """Return the mocap indices of several bodies, or None if one of the bodies is not kinematic."""
        if names not in self._mocaps:
            numbers = [self.bodies[name].mocap for name in names]
            self._mocaps[names] = None if min(numbers, default=-1) < 0 else columns_of(numbers)
        return self._mocaps[names]

    def apply_wrench(self, body: str, force_world: Floats, torque_world: Floats, mask: Mask | None = None) -> None:
        parameters.body_id(self, body)  # raises an error if the body does not exist
        self._applied.add(body, force_world, torque_world, mask)

    def parameter(self, name: str, target: str = "") -> Floats:
        return parameters.read(self, name, target)

    def parameter_targets(self, name: str) -> Sequence[str]:
        """Return the targets of a parameter; the targets of ``size`` are the scene bodies that can be resized."""
        if name in Looks.names:
            return self.looks.targets(name)
        return self.scene.sizable_bodies if name == "size" else super().parameter_targets(name)

    def write_parameter(self, name: str, target: str, values: Floats, mask: Mask | None = None) -> None:
        parameters.write(self, name, target, values, mask)
        self._mark_model_stale()
        self.mark_stale(mask)

    def snapshot(self) -> Snapshot:
        state: Snapshot = {"state": self.batch.state.copy(), "warning": self.batch.warning.copy()}
        state["efforts"] = self.efforts.copy()
        sensed = {f"wrench/{name}": wrench.copy() for name, wrench in self.sensor_wrenches.items()}
        parts = (self.contacts.snapshot(), sensed, self._applied.snapshot(), parameters.snapshot(self))
        return state | {name: array for part in parts for name, array in part.items()}

    def restore(self, snapshot: Snapshot) -> None:
        parameters.restore(self, snapshot)
        self._mark_model_stale()
        self.batch.state[:] = snapshot["state"]
        self.batch.warning[:] = snapshot["warning"]
        self.efforts[:] = snapshot.get("efforts", 0.0)
        self._applied.restore(snapshot)
        self.contacts.restore(snapshot)
        for name, wrench in self.sensor_wrenches.items():
            wrench[:] = snapshot.get(f"wrench/{name}", 0.0)
        self.mark_stale(None)

    def render(
        self,
        mask: Mask | None = None,
        camera: str | None = None,
        size: tuple[int, int] = (480, 640),
        modality: str = "rgb",
        markers: Sequence[Marker] = (),
        fast: bool = False,
    ) -> np.ndarray[Any, Any]:
        self._check_open()
        if camera is not None and camera not in self.scene.cameras:
            raise UnknownNameError("camera", camera, self.scene.cameras)
        check_name("modality", modality, self.render_modalities)
        name = camera or next(iter(self.scene.cameras), None)
        if self._renderer is not None and self.looks.needs_scenery and not self._draws_scenery:
            self._renderer.close()
            self._renderer = None
        if self._renderer is None:
            self._renderer = RenderPool(self._drawn(), self._num_threads, self.num_envs)
        chosen = list(range(self.num_envs)) if mask is None else np.flatnonzero(mask).tolist()
        height, width = size
        drawn = chosen or [0]  # an empty mask still requires one image to determine the shape and dtype
        pictures = self._renderer.draw(drawn, name, (height, width), modality, markers, fast)
        return np.stack(pictures)[: len(chosen)]

    def open_viewer(self) -> None:
        self._check_open()
        if self._viewer is None:
            self._viewer = Viewer(self._drawn())
        self._viewer.sync()

    def overlaps(self, robot: str = "robot") -> Sequence[Overlap]:
        """Return a robot's overlapping link pairs in the first environment, deepest first.

        Link pairs that overlap at the home position are included, although they never collide in the simulation.
        """
        check_name("robot of the simulation", robot, self.robots)
        model = self._build_model(overlaps=True)
        return find_overlaps(model, self.batch.state[0], f"{robot}/")

    def export_mjcf(self) -> Mjcf:
        """Return the model, including visual shapes, for other programs that use MuJoCo.

        Parameters that were changed after the simulation was built are not included.

        Raises:
            SimulationError: A part of a robot's MJCF file is stored in another file, such as a mesh or a texture.
        """
        model, spec = self._build(visuals=True)
        return write_mjcf(model, spec)

    def bare_engine(self) -> BareMujoco:
        return BareMujoco(self.model, self.num_envs, self.batch.nthread)

    def close(self) -> None:
        """Release the window and the OpenGL contexts. Repeated calls have no effect."""
        for resource in (self._renderer, self._viewer):
            if resource is not None:
                resource.close()
        self._renderer = self._viewer = None
        self._closed = True

    def _drawn(self) -> Drawn:
        self._draws_scenery = self.looks.needs_scenery
        if not self._draws_scenery:
            return Drawn(self._build_model(visuals=True), self.batch, self.sizes, self.looks)
        model = self._build_model(visuals=True, spare=True)
        self.looks.adopt_span(model)
        return Drawn(model, self.batch, self.sizes, self.looks)

    def _build_model(self, *, visuals: bool = False, overlaps: bool = False, spare: bool = False) -> mujoco.MjModel:
        return self._build(visuals=visuals, overlaps=overlaps, spare=spare)[0]

    def _build(
        self, *, visuals: bool = False, overlaps: bool = False, spare: bool = False
    ) -> tuple[mujoco.MjModel, mujoco.MjSpec]:
        return build_model(
            self._placements,
            self.scene,
            self.physics_timestep,
            visuals=visuals,
            overlaps=overlaps,
            spare=spare,
            options=self._options,
        )

    def mark_stale(self, mask: Mask | None) -> None:
        """Mark the environments' states as changed, so that derived values are recomputed before they are read."""
        if mask is None:
            self.stale = self._everywhere
        else:
            self.stale = mask.copy() if self.stale is None else self.stale | mask

    def mark_constants_stale(self, mask: Mask | None) -> None:
        """Mark masses as changed, so that MuJoCo's derived constants are recomputed before they are used."""
        if self._stale_constants is None:
            self._stale_constants = np.zeros(self.num_envs, np.bool_)
        self._stale_constants |= True if mask is None else mask

    def _set_constants(self) -> None:
        stale, self._stale_constants = self._stale_constants, None
        assert stale is not None
        self.batch.set_const(None if stale.all() else np.flatnonzero(stale))

    def _mark_model_stale(self) -> None:
        if self._kinematics is not None:
            self._kinematics.mark_model_stale()

    def refresh(self) -> None:
        """Recompute the derived values of all states that have changed."""
        if self.stale is not None:
            if self._stale_constants is not None:
                self._set_constants()
            if self._kinematics is not None:
                self._kinematics.update()
            else:
                self._disabled |= _NO_CONTACTS
                try:
                    self.batch.forward(None if self.stale.all() else np.flatnonzero(self.stale), stage=_VEL)
                finally:
                    self._disabled[:] = self._disabled_by_model
            self.stale = None

    def derived(self, field: str) -> Floats:
        """Return the current values of an MjData field that is derived from the states."""
        if field not in self._derived:
            source = self.batch.bind if self._kinematics is None else self._kinematics.field
            self._derived[field] = source(field)
            self.mark_stale(None)  # MuJoCo only fills a newly bound field in the next call
        self.refresh()
        return self._derived[field]

    def set_rows(self, columns: slice, rows: Floats) -> None:
        """Set the controls for each physics step of the next ``step``, (num_envs, decimation, columns)."""
        if self._rows is None or self._rows.shape[1] != rows.shape[1]:
            held = self.states["ctrl"]
            self._rows = np.repeat(held[:, None], rows.shape[1], axis=1)  # (num_envs, decimation, nu)
        self._rows[:, :, columns] = rows

    def _check_open(self) -> None:
        if self._closed:
            raise SimulationError("the simulation is closed.")


def _leave_no_log_file() -> None:
    """Prevent MuJoCo from writing warnings to MUJOCO_LOG.TXT, without affecting the console output."""
    config = mujoco.MjLogConfig.get()
    if config.logto_file:
        config.logto_file = False
        config.set()

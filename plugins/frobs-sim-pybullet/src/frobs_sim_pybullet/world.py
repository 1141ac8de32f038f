"""One environment, which is a separate Bullet physics server with robots, bodies and a floor."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from frobs_core.contracts import ContactState
from frobs_core.description import AT_REST, Attachment, Body, Placement, Scene
from frobs_core.models import home_positions
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SceneError
from frobs_sim_pybullet.articulation import FASTEST, Articulation
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.contacts import Side, force_on_first, question
from frobs_sim_pybullet.drive import Drive
from frobs_sim_pybullet.engine import Dynamics, connect
from frobs_sim_pybullet.frames import Frames
from frobs_sim_pybullet.layout import Arrays, split
from frobs_sim_pybullet.lidar import Collider, Rays
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.options import Engine
from frobs_sim_pybullet.shapes import add_body, is_plain, prepare
from frobs_sim_pybullet.transforms import IDENTITY, Quat, Vector, compose, cross, from_pose, invert, rotate
from frobs_sim_pybullet.wrenches import WrenchSensor

ROBOT_GROUPS = tuple(1 << bit for bit in range(6, 30))
"""Bullet's collision groups of the robots. A robot's lidars ignore the robot's own group."""


_WELD_FORCE = 1e5  # [N] and [N·m] maximum load; with Bullet's default, attachments break at a few newtons


class RobotRow(NamedTuple):
    """A robot's rows of the shared arrays in one environment."""

    command: np.ndarray[Any, Any]
    gains: np.ndarray[Any, Any]
    positions: np.ndarray[Any, Any]
    velocities: np.ndarray[Any, Any]
    efforts: np.ndarray[Any, Any]

    @classmethod
    def of(cls, row: Arrays, robot: str) -> RobotRow:
        """Return one robot's rows of the shared arrays."""
        return cls(*(row[f"robots/{robot}/{field}"] for field in cls._fields))


class World:
    """One environment."""

    def __init__(
        self,
        robots: Mapping[str, Placement],
        scene: Scene,
        engine: Engine,
        dynamics: Dynamics,
        meshes: MeshFiles,
        row: Arrays,
    ) -> None:
        self._placements, self._scene = robots, scene
        self._engine, self._h = engine, engine.timestep
        self._dynamics, self._meshes, self._row = dynamics, meshes, row
        self._time = row["time"]
        self._watched: dict[str, Callable[[], None]] = {}
        self._still: set[str] = set()
        self._moving: list[Callable[[], None]] = []
        self._parameters: dict[tuple[str, str], Any] = {}
        self._resized = False  # whether a body size has been changed since the bodies were built
        self._build()

    def _build(self) -> None:
        client = self.client = connect()
        p.setTimeStep(self._h, client)
        p.setGravity(*self._scene.gravity, client)
        # Sorting the contact pairs makes the results independent of the simulation's history before a reset or restore.
        # With a nonzero contact slop, bodies would first sink in and then be pushed up with more than their weight.
        p.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, contactSlop=0.0, **self._engine.parameters, physicsClientId=client
        )
        sides: dict[str, Side] = {}
        if self._scene.floor:
            plane = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=client)
            floor = p.createMultiBody(0.0, plane, physicsClientId=client)
            prepare(client, floor, 1.0)  # _set_friction applies the floor's friction to the bodies
            sides["floor"] = floor, -1
        bodies = {
            name: body.resized(self._parameters.get(("size", name), 1.0)) for name, body in self._scene.bodies.items()
        }
        self._resized = False
        self.bodies = {name: add_body(client, body, self._meshes) for name, body in bodies.items()}
        self._coms = {  # pose of Bullet's frame in each body's frame, if they differ
            name: p.getDynamicsInfo(number, -1, client)[3:5]
            for name, number in self.bodies.items()
            if not is_plain(bodies[name])
        }
        for name, body in self._scene.bodies.items():
            if body.twist != AT_REST:
                self._set_twist(name, *body.twist)
        self._moments = {name: p.getDynamicsInfo(number, -1, client)[2] for name, number in self.bodies.items()}
        sides.update(
            {name: (number, -1) for name, number in self.bodies.items() if self._scene.bodies[name].collisions}
        )
        if len(self._placements) > len(ROBOT_GROUPS):
            raise SceneError(
                "the scene",
                f"has {len(self._placements)} robots; PyBullet supports at most {len(ROBOT_GROUPS)}.",
            )
        self.robots: dict[str, Articulation] = {}
        for (name, placement), group in zip(self._placements.items(), ROBOT_GROUPS, strict=False):
            robot = self.robots[name] = Articulation(client, name, placement, self._dynamics, self._meshes, group)
            sides[name] = robot.body, -2
            sides.update({f"{name}/{link}": (robot.body, index) for link, index in robot.links.items()})
            robot.place()
            if not robot.floating:
                for other in [floor, *self.bodies.values()] if self._scene.floor else self.bodies.values():
                    p.setCollisionFilterPair(robot.body, other, -1, -1, 0, client)  # neither can move the other
        self.sides = sides
        for name, attachment in self._scene.attachments.items():
            self._attach(attachment, from_pose(self._scene.attachment_pose(name, self._placements)))
        self._drives = {name: Drive(robot, self._h, self._scene.gravity) for name, robot in self.robots.items()}
        self._driven = [(name, drive, RobotRow.of(self._row, name)) for name, drive in self._drives.items()]
        self._contacts = [question(contact, sides) for contact in self._scene.contacts.values()]
        self._wrenches = [
            (WrenchSensor(self.robots[name], link, pose), self._row[f"robots/{name}/wrench/{sensor}"])
            for name, placement in self._placements.items()
            for sensor, (link, pose) in placement.force_torque_sensors.items()
        ]
        self._rays = Rays(client, self._colliders(bodies))
        self._free = [number for name, number in self.bodies.items() if self._scene.bodies[name].is_free]
        self._steps, self._broken = 0, False
        self._body_pushes: list[tuple[int, Vector, Vector]] = []
        for name in self.bodies:
            self._set_friction(name)
        for (name, target), value in self._parameters.items():
            self._apply(name, target, value)
        for name, robot in self.robots.items():
            self._put_home(name, robot)
            robot.let_overlap()
        self._fresh: int = p.saveState(client)

    def _colliders(self, bodies: Mapping[str, Body]) -> dict[Side, Collider]:
        colliders: dict[Side, Collider] = {}
        for name, number in self.bodies.items():
            parts = tuple((shape.geometry, shape.origin) for shape in bodies[name].collisions)
            colliders[number, -1] = parts, partial(self.body_frame, name)
        for name, robot in self.robots.items():
            shapes = {link.name: link.collisions for link in self._placements[name].model.links}
            for link, index in robot.links.items():
                parts = tuple((shape.geometry, shape.origin) for shape in shapes[link])
                colliders[robot.body, index] = parts, partial(robot.link_frame, index)
        return colliders

    def _attach(self, attachment: Attachment, pose: tuple[Vector, Quat]) -> None:
        """Attach two bodies or links to each other.

        ``pose`` is the pose of the second body or link in the frame of the first.
        """
        (first, first_link, first_at), (second, second_link, second_at) = (
            self._in_bullet(side) for side in (attachment.first, attachment.second)
        )
        parent, child = compose(first_at, pose), second_at
        weld = p.createConstraint(
            *(first, first_link, second, second_link, p.JOINT_FIXED, (0.0, 0.0, 0.0)),
            *(parent[0], child[0], parent[1], child[1], self.client),
        )
        p.changeConstraint(weld, maxForce=_WELD_FORCE, physicsClientId=self.client)
        p.setCollisionFilterPair(first, second, first_link, second_link, 0, self.client)

    def _in_bullet(self, side: str) -> tuple[int, int, tuple[Vector, Quat]]:
        """Return Bullet's indices for a scene body or ``robot/link``, and the pose of the object's frame.

        The indices are the body index and the link index. The pose is relative to Bullet's frame of the link.
        """
        if side in self.bodies:
            return self.bodies[side], -1, invert(self._coms.get(side, IDENTITY))
        name, _, link = side.partition("/")
        robot = self.robots[name]
        body, offset = robot.bones.frames[link]
        index = robot.links[body]
        return robot.body, index, compose(robot.com_backs[index], offset)

    def body_frame(self, name: str) -> tuple[Vector, Quat]:
        """Return the pose of a scene body's frame."""
        pose: tuple[Vector, Quat] = p.getBasePositionAndOrientation(self.bodies[name], self.client)
        com = self._coms.get(name)
        return pose if com is None else compose(pose, invert(com))

    def _set_twist(self, name: str, lin: Vector, ang: Vector) -> None:
        """Set the linear velocity of a scene body's origin and the body's angular velocity."""
        if name in self._coms:
            shift = cross(ang, rotate(self.body_frame(name)[1], self._coms[name][0]))
            lin = lin[0] + shift[0], lin[1] + shift[1], lin[2] + shift[2]
        p.resetBaseVelocity(self.bodies[name], lin, ang, self.client)

    def _twist(self, name: str) -> tuple[Vector, Vector]:
        lin, ang = p.getBaseVelocity(self.bodies[name], self.client)
        if name in self._coms:  # Bullet's linear velocity refers to the center of mass
            shift = cross(ang, rotate(self.body_frame(name)[1], self._coms[name][0]))
            lin = lin[0] - shift[0], lin[1] - shift[1], lin[2] - shift[2]
        return lin, ang

    def _put(self, name: str, frame: tuple[Vector, Quat]) -> None:
        com = self._coms.get(name)
        pose = frame if com is None else compose(frame, com)
        p.resetBasePositionAndOrientation(self.bodies[name], *pose, self.client)

    def _put_home(self, name: str, robot: Articulation) -> None:
        placement = self._placements[name]
        home = home_positions(placement.model, placement.robot.home).tolist()
        robot.write_joints(home, [0.0] * len(home))

    def reset(self) -> None:
        """Reset the environment to its initial state. Changed physical parameters keep their values."""
        if self._broken:
            self._rebuild()  # NaNs may have corrupted Bullet's state
        else:
            p.restoreState(self._fresh, physicsClientId=self.client)
        self._steps, self._broken = 0, False
        self._row["diverged"][...] = False
        for _name, drive in self._drives.items():
            drive.efforts = [0.0] * len(drive.efforts)
        for _, wrench in self._wrenches:
            wrench[:] = 0.0
        self._stop_pushing()
        self._written()

    def _rebuild(self) -> None:
        """Rebuild the physics server and all of its objects in the initial state."""
        self.close()
        self._build()
        self._meshes.clear()
        for channel in list(self._watched):
            self._watched[channel] = self._reader(channel)
        self._sort_readers()

    def apply_sizes(self) -> None:
        """Rebuild all objects in their current state if the size of a body has been changed.

        Bullet cannot change the size of a shape. All objects are rebuilt, because their order affects Bullet's solver.
        """
        if not self._resized or self._broken:
            return
        steps, drives = self._steps, self._drives
        bodies = {name: (self.body_frame(name), self._twist(name)) for name in self.bodies}
        robots = {robot.body: self._motion(robot.body) for robot in self.robots.values()}
        self._rebuild()
        self._steps = steps
        for name, drive in self._drives.items():
            drive.efforts = drives[name].efforts
        for name, (frame, twist) in bodies.items():
            self._put(name, frame)
            self._set_twist(name, *twist)
        for number, (pose, motion, joints) in robots.items():  # the bodies keep their indices
            p.resetBasePositionAndOrientation(number, *pose, self.client)
            p.resetBaseVelocity(number, *motion, self.client)
            for joint, (position, velocity) in enumerate(joints):
                p.resetJointState(number, joint, position, velocity, self.client)
        self._written()

    def _motion(self, number: int) -> tuple[Any, Any, list[tuple[float, float]]]:
        """Return the pose and twist of a robot's base in Bullet, and the position and velocity of each joint."""
        client = self.client
        joints = [p.getJointState(number, joint, client)[:2] for joint in range(p.getNumJoints(number, client))]
        return p.getBasePositionAndOrientation(number, client), p.getBaseVelocity(number, client), joints

    def step(self, decimation: int, rows: Mapping[str, Floats]) -> None:
        """Advance the environment, unless it has diverged.

        Args:
            decimation: Number of physics steps.
            rows: Commands for each physics step, (decimation, dof), by robot. A robot that has no entry executes the
                command in the shared arrays.
        """
        if self._broken or self._row["diverged"]:
            self._row["diverged"][...] = True
            return
        client, drives = self.client, []
        for name, drive, own in self._driven:
            self.robots[name].refresh()
            drive.set_gains(own.gains)
            given = rows.get(name) if rows else None
            drives.append((drive, [own.command.tolist()] * decimation if given is None else given.tolist()))
        for name in ContactState.fields(self._scene) if self._contacts else ():
            self._row[name][...] = 0
        for _, wrench in self._wrenches:
            wrench[:] = 0.0
        for k in range(decimation):
            for drive, commands in drives:
                if not drive(commands[k]):
                    self._broken = True
                    self._row["diverged"][...] = True
                    return
            for number, force, torque in self._body_pushes:
                at = p.getBasePositionAndOrientation(number, client)[0]
                p.applyExternalForce(number, -1, force, at, p.WORLD_FRAME, client)
                p.applyExternalTorque(number, -1, torque, p.WORLD_FRAME, client)
            p.stepSimulation(client)
            if self._contacts:
                self._watch_contacts(decimation)
            for sensor, wrench in self._wrenches:
                wrench += sensor.read() / decimation
        self._steps += decimation
        self._stop_pushing()
        for number in self._free:
            lin, ang = p.getBaseVelocity(number, client)
            if not math.hypot(*lin, *ang) < FASTEST:
                self._broken = True
                self._row["diverged"][...] = True
                return
        self._publish()

    def _stop_pushing(self) -> None:
        self._body_pushes.clear()
        for drive in self._drives.values():
            drive.stop_pushing()

    def _watch_contacts(self, decimation: int) -> None:
        closed, normal_force, resultant = (self._row[name] for name in ContactState.fields(self._scene))
        for point in p.getContactPoints(physicsClientId=self.client):
            force, distance = point[9], point[8]
            if not (force > 0.0 or distance <= 0.0):
                continue
            for i, asked in enumerate(self._contacts):
                direction = None if asked is None else asked.direction(point)
                if direction is not None:
                    closed[i] = True
                    normal_force[i] = max(normal_force[i], force)
                    resultant[i] += direction / decimation * force_on_first(point)

    def _written(self) -> None:
        """Update all shared arrays after the state has been written."""
        for drive in self._drives.values():
            drive.forget()
        self._publish()
        for channel, read in self._watched.items():
            if channel in self._still:
                read()

    def _publish(self) -> None:
        """Update all shared arrays that a step can change."""
        self._time[...] = self._steps * self._h
        for _, drive, own in self._driven:
            own.positions[:], own.velocities[:] = drive.states()
            own.efforts[:] = drive.applied()
        for read in self._moving:
            read()

    def watch(self, channel: str) -> None:
        """Keep an array with poses, twists or Jacobians up to date from now on."""
        if channel not in self._watched:
            self._watched[channel] = self._reader(channel)
            self._watched[channel]()
            self._sort_readers()

    def _sort_readers(self) -> None:
        """Separate the arrays that a step can change from the arrays that stay constant."""
        self._still = {channel for channel in self._watched if self._stands(channel)}
        self._moving = [read for channel, read in self._watched.items() if channel not in self._still]

    def _stands(self, channel: str) -> bool:
        kind, name, field, *link = split(channel)
        if kind == "bodies":
            return not self._scene.bodies[name].is_free
        robot = self.robots[name]
        return not robot.floating and field != "jacobian" and robot.links[robot.bones.frames[link[0]][0]] < 0

    def _reader(self, channel: str) -> Callable[[], None]:
        kind, name, field, *link = split(channel)
        if kind == "robots":
            return Frames(self.robots[name], self._drives[name], self._row).reader(field, link[0])
        row = self._row[channel]

        def read_pose() -> None:
            pos, (x, y, z, w) = self.body_frame(name)
            row[:] = (*pos, w, x, y, z)

        def read_twist() -> None:
            lin, ang = self._twist(name)
            row[:] = (*lin, *ang)

        return read_pose if field == "pose" else read_twist

    def _apply(self, name: str, target: str, value: Any) -> None:
        match name:
            case "gravity":
                p.setGravity(*value, self.client)
                for drive in self._drives.values():
                    drive.set_gravity(tuple(value))
            case "friction" if target == "floor":
                for each in self.bodies:
                    self._set_friction(each)
            case "friction" if target in self.bodies:
                self._set_friction(target)
            case "friction":
                body, link = self.sides[target]
                p.changeDynamics(body, link, lateralFriction=value, physicsClientId=self.client)
            case "mass" if target in self.bodies:
                number, inertial = self.bodies[target], self._scene.bodies[target].inertial
                assert inertial is not None
                moments = [moment * value / inertial.mass for moment in self._moments[target]]
                p.changeDynamics(number, -1, mass=value, localInertiaDiagonal=moments, physicsClientId=self.client)
            case "mass":
                robot, _, part = target.partition("/")
                self.robots[robot].write_mass(part, value)

    def _set_friction(self, name: str) -> None:
        """Set the sliding friction of a scene body in Bullet.

        Bullet multiplies the friction coefficients of two bodies, whereas MuJoCo uses the larger coefficient. To
        reproduce MuJoCo's friction on the floor, the floor's coefficient is always 1 in Bullet, and a free body's
        coefficient is the larger of the two original coefficients.
        """
        body = self._scene.bodies[name]
        friction = self._parameters.get(("friction", name), body.friction)
        if body.is_free and self._scene.floor:
            friction = max(friction, self._parameters.get(("friction", "floor"), self._scene.floor_friction))
        p.changeDynamics(self.bodies[name], -1, lateralFriction=friction, physicsClientId=self.client)

    def close(self) -> None:
        """Disconnect."""
        for robot in self.robots.values():
            robot.close()
        p.disconnect(self.client)

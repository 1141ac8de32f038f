"""A robot in one environment, as a Bullet body without Bullet's default damping, motors and velocity limits."""

from __future__ import annotations

from itertools import combinations

from frobs_core.description import Placement
from frobs_core.models import JointType
from frobs_sim_pybullet.bullet import pybullet as p
from frobs_sim_pybullet.engine import MARGIN, SELF_COLLISION, Dynamics, load_urdf
from frobs_sim_pybullet.meshes import MeshFiles
from frobs_sim_pybullet.transforms import Quat, Vector, compose, conjugate, from_pose, invert, rotate
from frobs_sim_pybullet.urdf import VIRTUAL, principal, skeleton, write_dynamics_urdf, write_urdf

FASTEST = 1e6
"""Velocity beyond which an environment is considered diverged [rad/s or m/s]."""

_STATIC = 2  # Bullet's collision group for static bodies
_LEAST_RATIO = 1e-30  # PyBullet ignores a gear ratio of 0, so that the ratio would be 1


class Articulation:
    """A robot's body in the simulated world, and a twin body without shapes that is used to compute mass matrices.

    Attributes:
        body: Bullet's index of the body.
        links: Bullet's link index of each link that is a separate body, by link name. The base has the index −1.
        joints: Bullet's indices of the moving joints, in the order of the mass matrix's columns.
        slots: Index in ``joints`` of each actuated joint, in the model file's order.
        in_order: Whether the actuated joints and the moving joints are the same joints in the same order.
        mimics: For each mimic joint, the indices in ``joints`` of the joint and of its leader, and the model's mimic
            element.
        offset: Number of columns in the mass matrix that belong to the base.
        twin: Bullet's index of the twin body.
        twin_links: Bullet's link indices in the twin body, by link name.
    """

    def __init__(
        self, client: int, name: str, placement: Placement, dynamics: Dynamics, meshes: MeshFiles, group: int
    ) -> None:
        self.client, self.name, self.placement, self.dynamics = client, name, placement, dynamics
        model, robot = placement.model, placement.robot
        self.floating = robot.base != "fixed"
        self.offset = VIRTUAL if self.floating else 0
        self.bones = skeleton(model, floating=self.floating)
        self.body = load_urdf(
            write_urdf(model, meshes, floating=self.floating),
            client,
            fixed=not self.floating,
            flags=SELF_COLLISION if robot.self_collision else 0,
            source=str(model.path),
        )
        self.links, indices = {self.bones.bodies[0]: -1}, {}
        for index in range(p.getNumJoints(self.body, client)):
            info = p.getJointInfo(self.body, index, client)
            self.links[info[12].decode()] = indices[info[1].decode()] = index
        self._masses: dict[str, float] = {}
        self._stale = False
        self._own_dynamics: Dynamics | None = None
        self.twin = dynamics.load(self._twin_text())
        twin = [
            p.getJointInfo(self.twin, i, dynamics.client) for i in range(p.getNumJoints(self.twin, dynamics.client))
        ]
        self.twin_links = {info[12].decode(): i for i, info in enumerate(twin)}
        self.twin_links.setdefault(self.bones.bodies[0], -1)
        by_name = {joint.name: joint for joint in model.joints}
        names = [info[1].decode() for info in twin if info[2] != p.JOINT_FIXED][self.offset :]
        self.moving = [by_name[joint] for joint in names]
        self.joints = [indices[joint] for joint in names]
        self.slots = [names.index(joint) for joint in model.joint_names]
        self.in_order = self.slots == list(range(len(names)))
        self.mimics = [
            (names.index(joint.name), names.index(joint.mimic.joint), joint.mimic)
            for joint in model.joints
            if joint.mimic is not None and joint.type is not JointType.FIXED
        ]
        self.coms: dict[int, tuple[Vector, Quat]] = {}  # Bullet's frame of a link is at the link's center of mass
        for index in self.links.values():
            self.coms[index] = p.getDynamicsInfo(self.body, index, client)[3:5]
        self.com_backs = {index: invert(com) for index, com in self.coms.items()}
        self._prepare(group)

    def _twin_text(self) -> str:
        return write_dynamics_urdf(self.placement.model, self._masses, floating=self.floating)

    def _prepare(self, group: int) -> None:
        client = self.client
        for name, link in self.links.items():
            p.changeDynamics(
                self.body,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                rollingFriction=0.0,
                spinningFriction=0.0,
                restitution=0.0,
                collisionMargin=MARGIN,
                maxJointVelocity=2.0 * FASTEST,
                activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING,
                physicsClientId=client,
            )
            # Set the friction in a separate call. If the friction were set in the call above, Bullet would ignore it
            # and use its default of 0.5.
            friction = self.placement.robot.friction.get(name, 1.0)
            p.changeDynamics(self.body, link, lateralFriction=friction, physicsClientId=client)
            stands = link < 0 and not self.floating
            p.setCollisionFilterGroupMask(self.body, link, group, ~_STATIC if stands else -1, physicsClientId=client)
        for joint in self.joints:
            p.setJointMotorControl2(self.body, joint, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        # The drive law also moves mimic joints; these constraints help to hold them during contact.
        for follower, leader, mimic in self.mimics:
            ends = (self.body, self.joints[follower], self.body, self.joints[leader])
            gear = p.createConstraint(*ends, p.JOINT_GEAR, [0, 1, 0], [0, 0, 0], [0, 0, 0], physicsClientId=client)
            p.changeConstraint(
                gear,
                gearRatio=-mimic.multiplier or _LEAST_RATIO,
                relativePositionTarget=mimic.offset,
                erp=0.2,
                maxForce=1e4,
                physicsClientId=client,
            )
        if self.placement.robot.self_collision:
            self._part_neighbours()

    def _part_neighbours(self) -> None:
        """Disable collisions between links that are separated by at most one moving joint."""
        welds, neighbours = self.bones.welds, set()
        for joint, parent, _ in self.bones.joints:
            neighbours.add(frozenset((welds[parent], welds[joint.child])))
        for first, second in combinations(self.bones.bodies, 2):
            pair = frozenset((welds[first], welds[second]))
            if len(pair) == 1 or pair in neighbours:
                ends = self.links[first], self.links[second]
                p.setCollisionFilterPair(self.body, self.body, *ends, 0, physicsClientId=self.client)

    def base(self) -> tuple[Vector, Quat]:
        """Return the pose of the base link's frame."""
        return compose(p.getBasePositionAndOrientation(self.body, self.client), self.com_backs[-1])

    def com(self, index: int) -> tuple[Vector, Quat]:
        """Return the pose of a link's center of mass, which Bullet reports in double precision."""
        if index < 0:
            return p.getBasePositionAndOrientation(self.body, self.client)  # type: ignore[no-any-return]
        return p.getLinkState(self.body, index, 0, 1, self.client)[:2]  # type: ignore[no-any-return]

    def link_frame(self, index: int) -> tuple[Vector, Quat]:
        """Return the pose of a link's frame, as defined in the model."""
        return compose(self.com(index), self.com_backs[index])

    def on_twin(self, index: int, point: Vector) -> Vector:
        """Convert a point from a link's frame to the link's principal axes, as Bullet's Jacobian requires."""
        return rotate(conjugate(self.coms[index][1]), point)

    def put_root(self, root: tuple[Vector, Quat]) -> None:
        """Teleport the root link together with the base."""
        base = compose(root, invert(self.bones.root))
        p.resetBasePositionAndOrientation(self.body, *compose(base, self.coms[-1]), self.client)

    def place(self) -> None:
        """Move the root link to its initial pose in the scene."""
        self.put_root(from_pose(self.placement.pose))

    def write_joints(self, positions: list[float], velocities: list[float]) -> None:
        """Set the positions and velocities of the actuated joints, in the model file's order."""
        full: list[tuple[float, float]] = [(0.0, 0.0)] * len(self.joints)
        for slot, q, v in zip(self.slots, positions, velocities, strict=True):
            full[slot] = q, v
        for follower, leader, mimic in self.mimics:
            q, v = full[leader]
            full[follower] = mimic.multiplier * q + mimic.offset, mimic.multiplier * v
        for joint, (q, v) in zip(self.joints, full, strict=True):
            p.resetJointState(self.body, joint, q, v, self.client)

    def write_mass(self, link: str, mass: float) -> None:
        """Change a link's mass [kg], and scale its inertia by the same ratio."""
        if self.links[link] < 0 and not self.floating:
            return  # a fixed base must remain massless, because Bullet would otherwise let it fall
        inertial = next(other.inertial for other in self.placement.model.links if other.name == link)
        assert inertial is not None
        # Scale the model's inertia instead of the current inertia, so that the result does not depend on earlier
        # writes.
        moments = [moment * mass / inertial.mass for moment in principal(inertial)[2]]
        p.changeDynamics(
            self.body, self.links[link], mass=mass, localInertiaDiagonal=moments, physicsClientId=self.client
        )
        self._masses[link] = mass
        self._stale = True

    def refresh(self) -> None:
        """Apply changed masses to the twin body, which is rebuilt in a separate physics server."""
        if self._stale:
            if self._own_dynamics is None:
                self.dynamics = self._own_dynamics = Dynamics()
            self.dynamics.clear()
            self.twin = self.dynamics.load(self._twin_text())
            self._stale = False

    def close(self) -> None:
        """Disconnect from the twin body's separate physics server, if that server exists."""
        if self._own_dynamics is not None:
            self._own_dynamics.close()
            self._own_dynamics = None

    def overlaps(self) -> dict[tuple[str, str], float]:
        """Return the current penetration depth [m] of each pair of overlapping links that can collide."""
        p.performCollisionDetection(self.client)
        names = {index: name for name, index in self.links.items()}
        depths: dict[tuple[str, str], float] = {}
        for point in p.getContactPoints(self.body, self.body, physicsClientId=self.client):
            if point[8] < 0.0:
                pair = names[min(point[3:5])], names[max(point[3:5])]
                depths[pair] = max(-point[8], depths.get(pair, 0.0))
        return depths

    def let_overlap(self) -> None:
        """Disable collisions of currently overlapping links, because such collisions would make control impossible."""
        if self.placement.robot.self_collision:
            for first, second in self.overlaps():
                ends = self.links[first], self.links[second]
                p.setCollisionFilterPair(self.body, self.body, *ends, 0, physicsClientId=self.client)

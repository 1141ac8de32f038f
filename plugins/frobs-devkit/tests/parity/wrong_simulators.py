"""MuJoCo with one thing wrong each: what parity must find."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from frobs_core.description import DriveGains, Placement
from frobs_core.models import Pose
from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import Level, SimulatorRecord
from frobs_core.util.errors import SceneError, SimulationError
from frobs_sim_mujoco import plugin
from frobs_sim_mujoco.body import MujocoBody
from frobs_sim_mujoco.simulation import MujocoSimulation


class Changed(MujocoSimulation):
    """MuJoCo of robots that are not what was asked for."""

    def __init__(self, robots: Any, scene: Any, **keywords: Any) -> None:
        super().__init__({name: self.change(placement) for name, placement in robots.items()}, scene, **keywords)

    def change(self, placement: Placement) -> Placement:
        return placement


class Stiff(Changed):
    """Gains 1 % too high."""

    def change(self, placement: Placement) -> Placement:
        gains = placement.robot.gains
        assert gains is not None
        pairs = {name: gains.of(name) for name in placement.model.joint_names}
        stiffer = DriveGains(
            stiffness={name: 1.01 * kp for name, (kp, _) in pairs.items()},
            damping={name: kd for name, (_, kd) in pairs.items()},
        )
        return replace(placement, robot=replace(placement.robot, gains=stiffer))


class Heavy(Changed):
    """The forearm 1 % too heavy."""

    def change(self, placement: Placement) -> Placement:
        model = placement.model
        links = tuple(
            replace(link, inertial=replace(link.inertial, mass=1.01 * link.inertial.mass))
            if link.name == "link_3" and link.inertial
            else link
            for link in model.links
        )
        return replace(placement, model=replace(model, links=links))


class Crooked(Changed):
    """The elbow 0.1 mm too high."""

    def change(self, placement: Placement) -> Placement:
        model = placement.model
        joints = tuple(
            replace(joint, origin=Pose(tuple(np.add(joint.origin.pos, (0, 0, 1e-4)).tolist()), joint.origin.quat_wxyz))
            if joint.name == "joint_3"
            else joint
            for joint in model.joints
        )
        return replace(placement, model=replace(model, joints=joints))


class Strong(Changed):
    """Effort limits 1 % too high."""

    def change(self, placement: Placement) -> Placement:
        model = placement.model
        joints = tuple(
            replace(joint, limits=replace(joint.limits, effort=1.01 * joint.limits.effort)) for joint in model.joints
        )
        return replace(placement, model=replace(model, joints=joints))


class Boundless(Changed):
    """Effort limits that are none."""

    def change(self, placement: Placement) -> Placement:
        model = placement.model
        joints = tuple(replace(joint, limits=replace(joint.limits, effort=np.inf)) for joint in model.joints)
        return replace(placement, model=replace(model, joints=joints))


class Fine(MujocoSimulation):
    """Half the timestep, twice the steps."""

    def __init__(self, robots: Any, scene: Any, *, physics_timestep: float, **keywords: Any) -> None:
        super().__init__(robots, scene, physics_timestep=physics_timestep / 2.0, **keywords)

    def step(self, decimation: int) -> None:
        super().step(2 * decimation)


class SunkBody(MujocoBody):
    """Reads 2 mm too low."""

    @property
    def pose(self) -> Any:
        pos, quat = super().pose
        return pos - np.array([0.0, 0.0, 0.002]), quat


class Sunk(MujocoSimulation):
    """Bodies lie 2 mm too low."""

    def __init__(self, robots: Any, scene: Any, **keywords: Any) -> None:
        super().__init__(robots, scene, **keywords)
        self.bodies = {name: SunkBody(self, name, body) for name, body in scene.bodies.items()}


class Restless(MujocoSimulation):
    """Bodies never come to rest."""

    def step(self, decimation: int) -> None:
        for name in self.bodies:
            self.apply_wrench(name, np.array([[2.0, 0.0, 6.0]]), np.zeros((1, 3)))
        super().step(decimation)


class Slippery(MujocoSimulation):
    """Half of every friction of a body."""

    def __init__(self, robots: Any, scene: Any, **keywords: Any) -> None:
        names = ("friction", "torsional_friction", "rolling_friction")
        bodies = {
            name: replace(body, **{each: 0.5 * getattr(body, each) for each in names})
            for name, body in scene.bodies.items()
        }
        scene = replace(scene, bodies=bodies, floor_friction=0.5 * scene.floor_friction)
        super().__init__(robots, scene, **keywords)


class Oily(Changed):
    """Half of every friction of a robot's links."""

    def change(self, placement: Placement) -> Placement:
        halved = {link: 0.5 * friction for link, friction in placement.robot.friction.items()}
        return replace(placement, robot=replace(placement.robot, friction=halved))


class Bouncy(MujocoSimulation):
    """Bodies that fall bounce back with 0.6 times their speed."""

    def step(self, decimation: int) -> None:
        before = {name: body.twist[0].copy() for name, body in self.bodies.items()}
        super().step(decimation)
        for name, body in self.bodies.items():
            if np.any((before[name][:, 2] < -0.3) & (body.twist[0][:, 2] > before[name][:, 2])):
                body.write_twist(before[name] * [1.0, 1.0, -0.6], np.zeros((self.num_envs, 3)))


class Smooth(MujocoSimulation):
    """Rejects bodies with rolling friction."""

    def __init__(self, robots: Any, scene: Any, **keywords: Any) -> None:
        for name, body in scene.bodies.items():
            if body.rolling_friction:
                raise SceneError(f"scene body '{name}'", "has rolling friction.")
        super().__init__(robots, scene, **keywords)


class Farsighted(MujocoSimulation):
    """Rays are 2 mm too long."""

    def cast(self, *args: Any, **kwargs: Any) -> Any:
        return super().cast(*args, **kwargs) + 0.002


class Mad(MujocoSimulation):
    """Fails at the first step."""

    def step(self, decimation: int) -> None:
        raise SimulationError("the engine\nhas gone mad.")


WRONG = (
    Stiff,
    Heavy,
    Crooked,
    Strong,
    Boundless,
    Fine,
    Sunk,
    Restless,
    Slippery,
    Oily,
    Bouncy,
    Smooth,
    Farsighted,
    Mad,
)


@hookimpl
def frobs_simulators() -> list[SimulatorRecord]:
    (mujoco,) = plugin.frobs_simulators()
    found = [
        replace(mujoco, name=cls.__name__.lower(), summary=cls.__doc__, entry_point=f"wrong_simulators:{cls.__name__}")
        for cls in WRONG
    ]
    entry_points = {record.name: record.entry_point for record in found}
    claims = {
        "blind": {"rays": Level.UNSUPPORTED},
        "rough": {"drive": Level.APPROXIMATE},
        **{f"rough_{name}": {"drive": Level.APPROXIMATE} for name in ("stiff", "fine", "boundless")},
        "fixed": {"teleport": Level.UNSUPPORTED},
    }
    return found + [
        replace(
            mujoco,
            name=name,
            summary="MuJoCo that claims less",
            entry_point=entry_points.get(name.removeprefix("rough_"), mujoco.entry_point),
            capabilities={**mujoco.capabilities, **less},
        )
        for name, less in claims.items()
    ]

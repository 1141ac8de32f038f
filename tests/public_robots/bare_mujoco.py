"""A robot from an MJCF file beside bare MuJoCo with the same file: masses, joints, and how both move without drives."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from frobs_core import plugins
from frobs_core.contracts import CommandMode
from frobs_core.description import Placement, Robot, Scene
from frobs_core.models import Pose, load_model

SECONDS, TIMESTEP = 0.5, 0.002
_JOINTS = ("jnt_stiffness", "jnt_range", "jnt_limited", "jnt_axis", "jnt_pos")
_PLACES = ("qpos_spring", "qpos0")
_DOFS = ("dof_damping", "dof_armature", "dof_frictionloss")
_MOVING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


@dataclass(frozen=True)
class Beside:
    """Largest differences.

    Attributes:
        bodies: Of masses, centers of mass and moments of inertia, as a share of the largest of the robot.
        joints: Of all properties of joints, in their own units.
        motion: Of joint positions after 0.5 s without drives and without contacts other than the pairs of the file [rad or m].
    """

    bodies: float
    joints: float
    motion: float


def beside_mujoco(file: Path) -> Beside:
    """Compare the robot of an MJCF file with what MuJoCo makes of the file."""
    bare, model = mujoco.MjModel.from_xml_path(str(file)), load_model(file)
    free = bare.njnt > 0 and bare.jnt_type[0] == int(mujoco.mjtJoint.mjJNT_FREE)
    medium = {name: np.array(getattr(bare.opt, name)).tolist() for name in ("density", "viscosity", "wind")}
    placement = Placement(
        robot=Robot(model=str(file), base="floating" if free else "fixed", self_collision=False),
        model=model,
        pose=model.root_pose if free else Pose(),
        command_mode=CommandMode.EFFORT,
    )
    make = plugins.get_record("simulator", "mujoco").load()
    scene = Scene(floor=False, gravity=tuple(bare.opt.gravity.tolist()))
    with closing(make({"robot": placement}, scene, num_envs=1, physics_timestep=TIMESTEP, **medium)) as simulation:
        built = simulation.native.model
        names = [name for i in range(1, bare.nbody) if (name := bare.body(i).name)]
        of_bodies = [(bare.body(name).id, built.body(f"robot/{name}").id) for name in names]
        bodies = max(_apart(bare, built, field, of_bodies) for field in ("body_mass", "body_ipos", "body_inertia"))
        moving = [i for i in range(bare.njnt) if bare.jnt_type[i] in _MOVING and bare.joint(i).name]
        joints = [(i, built.joint(f"robot/{bare.joint(i).name}").id) for i in moving]
        dofs = [(bare.jnt_dofadr[i], built.jnt_dofadr[j]) for i, j in joints]
        places = [(bare.jnt_qposadr[i], built.jnt_qposadr[j]) for i, j in joints]
        found = [
            np.abs(np.subtract(getattr(bare, field)[i], getattr(built, field)[j], dtype=float)).max()
            for fields, pairs in ((_JOINTS, joints), (_PLACES, places), (_DOFS, dofs))
            for field in fields
            for i, j in pairs
        ]
        return Beside(bodies, float(max(found, default=0.0)), _motion(bare, simulation, places, free=free))


def _apart(bare: mujoco.MjModel, built: mujoco.MjModel, field: str, pairs: list[tuple[int, int]]) -> float:
    ours, theirs = getattr(built, field), getattr(bare, field)
    largest = max((np.abs(theirs[i] - ours[j]).max() for i, j in pairs), default=0.0)
    return float(largest / max(1e-9, np.abs(theirs).max()))


def _motion(bare: mujoco.MjModel, simulation, places: list[tuple[int, int]], *, free: bool) -> float:
    built, data = simulation.native.model, mujoco.MjData(bare)
    for name in ("timestep", "integrator", "solver", "cone", "impratio", "iterations", "tolerance"):
        setattr(bare.opt, name, getattr(built.opt, name))
    for name in ("ls_iterations", "ls_tolerance", "noslip_iterations", "magnetic"):
        setattr(bare.opt, name, getattr(built.opt, name))
    bare.opt.enableflags = built.opt.enableflags
    bare.opt.disableflags = built.opt.disableflags | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    bare.geom_contype[:] = bare.geom_conaffinity[:] = (
        0  # as without self_collision; pairs that the file names still touch
    )
    robot = simulation.robots["robot"]
    start = robot.home + np.random.default_rng(0).uniform(-0.2, 0.2, robot.home.shape)
    robot.write_joint_state(np.clip(start, robot.position_lower, robot.position_upper))
    qpos = simulation.native.batch.bind("qpos")[0]
    data.qpos[[i for i, _ in places]] = qpos[[j for _, j in places]]
    if free:
        at = built.joint("robot/base").qposadr[0]
        data.qpos[:7] = qpos[at : at + 7]
    steps = round(SECONDS / TIMESTEP)
    simulation.step(steps)
    mujoco.mj_step(bare, data, steps)
    qpos = simulation.native.batch.bind("qpos")[0]
    return float(max((abs(data.qpos[i] - qpos[j]) for i, j in places), default=0.0))

"""Bullet clients for the simulation and for computing the dynamics that the drives require."""

from __future__ import annotations

import os
import tempfile

from frobs_core.util.errors import ModelFileError, SimulationError
from frobs_sim_pybullet.bullet import pybullet, quiet
from frobs_sim_pybullet.transforms import Vector

# Without the second flag, cylinders become 32-sided prisms that are 1 mm too thick.
_FLAGS = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_IMPLICIT_CYLINDER
MARGIN = 1e-4
"""Collision margin of the base link's meshes [m].

Without a margin, rays would miss the base's meshes. The meshes of other links keep Bullet's margin of 1 mm.
"""
SELF_COLLISION = pybullet.URDF_USE_SELF_COLLISION


def connect() -> int:
    """Return a client for a new physics server in this process.

    Raises:
        SimulationError: Bullet did not provide a server, because it supports at most 1,024 servers per process.
    """
    client: int = pybullet.connect(pybullet.DIRECT)
    if client < 0:
        raise SimulationError(
            "Bullet supports at most 1,024 physics servers per process; increase num_threads to use more processes."
        )
    return client


def load_urdf(text: str, client: int, *, fixed: bool, flags: int = 0, source: str = "") -> int:
    """Load a URDF from text, and return the body's index.

    Raises:
        ModelFileError: Bullet rejected the URDF.
    """
    file, path = tempfile.mkstemp(suffix=".urdf")
    try:
        with os.fdopen(file, "w", encoding="utf-8") as handle:
            handle.write(text)
        body: int = pybullet.loadURDF(path, useFixedBase=fixed, flags=_FLAGS | flags, physicsClientId=client)
    except pybullet.error as error:
        raise ModelFileError(source or path, f"PyBullet rejects the model: {error}") from error
    finally:
        os.unlink(path)
    return body


class Dynamics:
    """Computes robots' mass matrices and bias forces in a Bullet client that has no shapes and is never stepped.

    The simulated bodies cannot be used for these computations, because Bullet caches their masses, ignores the
    orientation of a fixed base, and does not support inverse dynamics for a free base.
    """

    def __init__(self) -> None:
        self.client = connect()
        self._gravity: Vector | None = None
        self._bodies: dict[str, int] = {}

    def load(self, text: str) -> int:
        """Return the index of the body that a URDF describes. Identical robots share one body."""
        if text not in self._bodies:
            body = self._bodies[text] = load_urdf(text, self.client, fixed=True)
            joints = [
                pybullet.getJointInfo(body, i, self.client) for i in range(pybullet.getNumJoints(body, self.client))
            ]
            moving = sum(joint[2] != pybullet.JOINT_FIXED for joint in joints)
            if moving:
                with quiet():  # this call builds Bullet's model, which prints warnings about rounding errors
                    pybullet.calculateMassMatrix(body, [0.0] * moving, 0, self.client)
        return self._bodies[text]

    def clear(self) -> None:
        """Remove all bodies. If only some bodies were removed, Bullet would confuse new bodies with removed ones."""
        pybullet.resetSimulation(physicsClientId=self.client)
        self._bodies.clear()
        self._gravity = None

    def set_gravity(self, gravity: Vector) -> None:
        """Set the gravity vector for the next computations, in the base's frame [m/s²]."""
        if gravity != self._gravity:
            pybullet.setGravity(*gravity, self.client)
            self._gravity = gravity

    def close(self) -> None:
        """Disconnect."""
        pybullet.disconnect(self.client)

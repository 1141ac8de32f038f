"""Bullet's clients: one holds what is simulated, one what the drives need to know of it."""

from __future__ import annotations

import os
import tempfile

from frobs_core.errors import ModelFileError, SimulationError
from frobs_sim_pybullet.bullet import pybullet, quiet
from frobs_sim_pybullet.transforms import Vector

_FLAGS = (
    pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_IMPLICIT_CYLINDER
)  # else a prism of 32 sides, 1 mm too thick
MARGIN = 1e-4
"""[m] by which Bullet rounds a mesh of the base; without any its rays miss it. On other links it keeps its own 1 mm."""
SELF_COLLISION = pybullet.URDF_USE_SELF_COLLISION


def connect() -> int:
    """Return a client of a new physics server in this process.

    Raises:
        SimulationError: Bullet gives none; it can have 1,024 in one process.
    """
    client: int = pybullet.connect(pybullet.DIRECT)
    if client < 0:
        raise SimulationError(
            "Bullet gives no further physics server in this process (it can have 1,024); use more num_threads."
        )
    return client


def load_urdf(text: str, client: int, *, fixed: bool, flags: int = 0, source: str = "") -> int:
    """Load a URDF from its text; return the body's number.

    Args:
        text: The URDF.
        client: Where to.
        fixed: Whether the base is.
        flags: Further ones of Bullet.
        source: The file that it was made from, for messages.

    Raises:
        ModelFileError: Bullet refuses it.
    """
    file, path = tempfile.mkstemp(suffix=".urdf")
    try:
        with os.fdopen(file, "w", encoding="utf-8") as handle:
            handle.write(text)
        body: int = pybullet.loadURDF(path, useFixedBase=fixed, flags=_FLAGS | flags, physicsClientId=client)
    except pybullet.error as error:
        raise ModelFileError(source or path, f"PyBullet refuses the model: {error}") from error
    finally:
        os.unlink(path)
    return body


class Dynamics:
    """Mass matrices and bias forces of robots, in a client without gravity, shapes or time.

    The simulated bodies cannot be asked: Bullet caches what it knows of their masses, takes no account of how a fixed
    base is turned, and knows no inverse dynamics of a free base.
    """

    def __init__(self) -> None:
        self.client = connect()
        self._gravity: Vector | None = None
        self._bodies: dict[str, int] = {}

    def load(self, text: str) -> int:
        """Return the body of a URDF; two robots that are alike share one."""
        if text not in self._bodies:
            body = self._bodies[text] = load_urdf(text, self.client, fixed=True)
            joints = [
                pybullet.getJointInfo(body, i, self.client) for i in range(pybullet.getNumJoints(body, self.client))
            ]
            moving = sum(joint[2] != pybullet.JOINT_FIXED for joint in joints)
            if moving:
                with quiet():  # it builds its model now, and remarks on axes whose length is 1 but for the last bit
                    pybullet.calculateMassMatrix(body, [0.0] * moving, 0, self.client)
        return self._bodies[text]

    def clear(self) -> None:
        """Forget all bodies. Bullet keeps what it knows of a single body that is removed, and mistakes later ones for it."""
        pybullet.resetSimulation(physicsClientId=self.client)
        self._bodies.clear()
        self._gravity = None

    def set_gravity(self, gravity: Vector) -> None:
        """Set the gravity of the next questions, in the base's axes [m/s²]."""
        if gravity != self._gravity:
            pybullet.setGravity(*gravity, self.client)
            self._gravity = gravity

    def close(self) -> None:
        """Disconnect."""
        pybullet.disconnect(self.client)

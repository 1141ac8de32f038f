"""The contacts that a task or a sensor wants to know of, over a whole control step."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from frobs_core.arrays import Floats, Mask
from frobs_core.errors import SceneError
from frobs_core.interfaces import Contact, Placement, Scene

_FOUND, _FOUND_AND_FORCE = 1, 3  # bits of what a contact sensor tells: how many, and the force of the strongest


def _ignored(name: str, contact: Contact) -> dict[str, str]:
    """Return what a contact ignores by the name of the sensor that counts it; a robot covers its links."""
    whole = set(contact.ignore)
    return {f"{name} - {which}": which for which in contact.ignore if which.partition("/")[0] not in whole - {which}}


def add_contact(
    spec: mujoco.MjSpec, name: str, contact: Contact, robots: Mapping[str, Placement], scene: Scene
) -> None:
    """Add contact sensors: the number of contacts, and the force of the strongest.

    MuJoCo cannot leave anything out of ``"*"``. So what a contact ignores is counted by sensors of its own.
    """

    def side(which: str) -> tuple[mujoco.mjtObj, str]:
        if which == "*":
            return mujoco.mjtObj.mjOBJ_UNKNOWN, ""
        if which == "floor" and scene.floor:
            return mujoco.mjtObj.mjOBJ_GEOM, which
        if which in robots:
            return mujoco.mjtObj.mjOBJ_XBODY, f"{which}/{robots[which].model.root}"  # the whole subtree
        if spec.body(which) is None:
            known = [*scene.bodies, *robots, *(["floor"] if scene.floor else [])]
            raise SceneError(f"contact '{name}'", f"names '{which}', which is none of {', '.join(known)}.")
        return mujoco.mjtObj.mjOBJ_BODY, which

    first_type, first = side(contact.first)
    told = _FOUND if contact.ignore else _FOUND_AND_FORCE
    for sensor, second in {name: contact.second, **_ignored(name, contact)}.items():
        second_type, second_name = side(second)
        spec.add_sensor(
            name=sensor,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=first_type,
            objname=first,
            reftype=second_type,
            refname=second_name,
            intprm=[told, 2, 1],  # reduced by the largest force; one slot
        )


class ContactReader:
    """Reads the contact sensors of a model.

    Args:
        model: Compiled with the sensors of the scene's contacts.
        scene: That declares them.
    """

    def __init__(self, model: mujoco.MjModel, scene: Scene) -> None:
        def at(sensor: str) -> int:
            return int(model.sensor(sensor).adr[0])

        contacts = scene.contacts.items()
        self._counts = [at(name) for name, _ in contacts]
        # The force stands behind the count; where it is not told, the count stands in for it and is never read.
        self._forces = [at(name) + (0 if contact.ignore else 1) for name, contact in contacts]
        self._ignored = [(i, at(s)) for i, (name, contact) in enumerate(contacts) for s in _ignored(name, contact)]

    def read(self, data: Floats) -> tuple[Mask, Floats]:
        """Return which contacts were there, and the largest normal force of each [N], in each physics step.

        Args:
            data: (num_envs, decimation, nsensordata)

        Returns:
            (num_envs, decimation, contacts) both.
        """
        counts = data[..., self._counts]
        for column, at in self._ignored:
            counts[..., column] -= data[..., at]
        return counts > 0, np.abs(data[..., self._forces])

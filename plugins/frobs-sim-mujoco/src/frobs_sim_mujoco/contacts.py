"""Measures a scene's declared contacts over a whole control step."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from frobs_core.contracts import ContactState
from frobs_core.description import Contact, Placement, Scene
from frobs_core.util.arrays import Floats
from frobs_core.util.errors import SceneError
from frobs_sim_mujoco.columns import columns_of

_FOUND, _FORCE = 1, 2  # data flags of a contact sensor: number of contacts, and force
_STRONGEST, _TOTAL = 2, 3  # reductions of a contact sensor: contact with the largest force, or sum of all forces


def _ignored(name: str, contact: Contact) -> dict[str, str]:
    """Return the objects that a contact ignores, by sensor name, omitting single links of ignored robots."""
    ignored = set(contact.ignore)
    return {f"{name} - {which}": which for which in contact.ignore if which.partition("/")[0] not in ignored - {which}}


def add_contact(
    spec: mujoco.MjSpec, name: str, contact: Contact, robots: Mapping[str, Placement], scene: Scene
) -> None:
    """Add contact sensors for the number of contacts, the force of the strongest contact, and the total force.

    MuJoCo cannot exclude bodies from ``"*"``. Therefore, additional sensors measure the values to subtract from the
    results: the number of ignored contacts, and the force between bodies on the same side of the contact.
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
            raise SceneError(
                f"contact '{name}'", f"refers to '{which}', which does not exist; available: {', '.join(known)}."
            )
        return mujoco.mjtObj.mjOBJ_BODY, which

    def add(sensor: str, first: str, second: str, data: int, reduction: int) -> None:
        (first_type, first_name), (second_type, second_name) = side(first), side(second)
        spec.add_sensor(
            name=sensor,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=first_type,
            objname=first_name,
            reftype=second_type,
            refname=second_name,
            intprm=[data, reduction, 1],  # one slot
        )

    sides = contact.first, contact.second
    add(name, *sides, _FOUND if contact.ignore else _FOUND | _FORCE, _STRONGEST)
    for sensor, ignored in _ignored(name, contact).items():
        add(sensor, contact.first, ignored, _FOUND, _STRONGEST)
    if not contact.ignore:
        add(_total(name), *sides, _FORCE, _TOTAL)
        inner = contact.second if contact.first == "*" else contact.first
        if _overlaps(contact):
            add(_inner(name), inner, inner, _FORCE, _TOTAL)


def _total(name: str) -> str:
    return f"{name} = total"


def _inner(name: str) -> str:
    return f"{name} = inner"


def _overlaps(contact: Contact) -> bool:
    """Return whether the two sides of a contact can contain the same body."""
    return "*" in (contact.first, contact.second) or contact.first == contact.second


class ContactReader:
    """Reads the contact sensors of a model.

    Args:
        model: Compiled model with sensors for the scene's contacts.
        scene: Scene that declares the contacts.
    """

    def __init__(self, model: mujoco.MjModel, scene: Scene) -> None:
        def at(sensor: str) -> int:
            return int(model.sensor(sensor).adr[0])

        contacts = scene.contacts.items()
        # Weights that yield the number of contacts minus the number of ignored contacts. All values are integers, so
        # sums are exact in any order.
        counted = np.zeros((model.nsensordata, len(contacts)))
        for i, (name, contact) in enumerate(contacts):
            counted[at(name), i] = 1.0
            counted[[at(ignored) for ignored in _ignored(name, contact)], i] = -1.0
        self._counts = columns_of(np.flatnonzero(counted.any(axis=1)).tolist())
        self._counted = counted[self._counts]
        # In the sensor data, the force follows the count. For contacts that do not measure forces, the count is a
        # placeholder, and ``contact_force`` raises an error.
        self._forces = [at(name) + (0 if contact.ignore else 1) for name, contact in contacts]
        self._totals = [(i, at(_total(name))) for i, (name, contact) in enumerate(contacts) if not contact.ignore]
        self._inner = [(i, at(_inner(name))) for i, (name, c) in enumerate(contacts) if _overlaps(c) and not c.ignore]

    def read(self, data: Floats, contacts: ContactState) -> None:
        """Compute a control step's contact state from sensor data.

        Args:
            data: Sensor data after each physics step, (num_envs, decimation, nsensordata).
            contacts: Contact state to update.
        """
        np.logical_or.reduce(data[..., self._counts] @ self._counted > 0, axis=1, out=contacts.closed)
        if not self._totals:  # no forces are measured for contacts that ignore bodies
            return
        np.maximum.reduce(np.abs(data[..., self._forces]), axis=1, out=contacts.normal_force)
        mean = np.add.reduce(data, axis=1) / data.shape[1]
        for column, at in self._totals:
            # MuJoCo reports the force that acts on the second side.
            contacts.resultant[:, column] = -mean[:, at : at + 3]
        for column, at in self._inner:
            contacts.resultant[:, column] += mean[:, at : at + 3]

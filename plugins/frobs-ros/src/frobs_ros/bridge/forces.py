"""Temporary forces on bodies and joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from frobs_core.util.arrays import Floats

if TYPE_CHECKING:
    from frobs_ros.bridge.world import World


@dataclass(frozen=True)
class Force:
    """A temporary force on a part of a model.

    Attributes:
        part: Name of the link or joint.
        start_ns: Start of the force in simulated time [ns].
        end_ns: End of the force in simulated time [ns], or None if the force lasts until a client clears it.
    """

    model: str
    part: str
    start_ns: int
    end_ns: int | None


@dataclass(frozen=True)
class JointEffort(Force):
    """A temporary effort on a joint [N·m or N]."""

    effort: float


@dataclass(frozen=True)
class BodyWrench(Force):
    """A force, (3,) [N], and a torque, (3,) [N·m], at a link's center of mass, in the world frame."""

    force: Floats
    torque: Floats


class Forces:
    """All current and future forces."""

    def __init__(self) -> None:
        self._all: list[Force] = []

    def add(self, force: Force) -> None:
        """Add a force."""
        self._all.append(force)

    def clear(self) -> None:
        """Remove all forces."""
        self._all.clear()

    def remove(self, model: str, part: str | None = None, kind: type[Force] = Force) -> None:
        """Remove the forces of a kind on a model, or only the forces on one of its links or joints."""
        self._all = [
            force
            for force in self._all
            if not (isinstance(force, kind) and force.model == model and part in (None, force.part))
        ]

    def next_change_ns(self, now_ns: int) -> int | None:
        """Return the next time at which a force begins or ends [ns], or None if there is no such time."""
        times = [t for f in self._all for t in (f.start_ns, f.end_ns) if t is not None and t > now_ns]
        return min(times, default=None)

    def apply(self, world: World) -> None:
        """Apply the current forces during the next step and remove expired forces.

        The step must end no later than the time that :meth:`next_change_ns` returns.
        """
        self._all = [f for f in self._all if f.end_ns is None or f.end_ns > world.time_ns]
        for model in world.robots():
            model.joint_targets.efforts[:] = 0.0
        wrenches: dict[str, tuple[Floats, Floats]] = {}
        for force in self._all:
            if force.start_ns > world.time_ns:
                continue
            model = world.models[force.model]
            if isinstance(force, JointEffort):
                model.joint_targets.efforts[model.joints[force.part]] += force.effort
            elif isinstance(force, BodyWrench):
                body = f"{model.key}/{force.part}"
                linear, angular = wrenches.get(body, (0.0, 0.0))
                wrenches[body] = linear + force.force, angular + force.torque
        assert world.simulation is not None
        for body, (linear, angular) in wrenches.items():
            world.simulation.apply_wrench(body, linear[None], angular[None])

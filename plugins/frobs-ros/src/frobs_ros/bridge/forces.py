"""Temporary forces on bodies and joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from frobs_core.util.arrays import Floats

if TYPE_CHECKING:
    from frobs_ros.bridge.world import World


@dataclass(frozen=True)
class JointEffort:
    """A temporary effort on a joint.

    Attributes:
        effort: [N·m or N]
        start_ns: Start of the effort in simulated time [ns].
        end_ns: End of the effort in simulated time [ns], or None if the effort lasts until a client clears it.
    """

    model: str
    joint: str
    effort: float
    start_ns: int
    end_ns: int | None


@dataclass(frozen=True)
class BodyWrench:
    """A force and a torque at a link's center of mass, in the world frame.

    Attributes:
        force: (3,) [N]
        torque: (3,) [N·m]
        start_ns: Start of the wrench in simulated time [ns].
        end_ns: End of the wrench in simulated time [ns], or None if the wrench lasts until a client clears it.
    """

    model: str
    link: str
    force: Floats
    torque: Floats
    start_ns: int
    end_ns: int | None


class Forces:
    """All current and future forces."""

    def __init__(self) -> None:
        self._all: list[JointEffort | BodyWrench] = []

    def add(self, force: JointEffort | BodyWrench) -> None:
        """Add a force."""
        self._all.append(force)

    def clear(self) -> None:
        """Remove all forces."""
        self._all.clear()

    def clear_link(self, model: str, link: str) -> None:
        """Remove the forces on a link."""
        self._all = [f for f in self._all if not (isinstance(f, BodyWrench) and (f.model, f.link) == (model, link))]

    def clear_joint(self, model: str, joint: str) -> None:
        """Remove the efforts on a joint."""
        self._all = [f for f in self._all if not (isinstance(f, JointEffort) and (f.model, f.joint) == (model, joint))]

    def drop_model(self, model: str) -> None:
        """Remove all forces on a deleted model."""
        self._all = [force for force in self._all if force.model != model]

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
                model.joint_targets.efforts[model.joints[force.joint]] += force.effort
            else:
                body = f"{model.key}/{force.link}"
                linear, angular = wrenches.get(body, (0.0, 0.0))
                wrenches[body] = linear + force.force, angular + force.torque
        assert world.simulation is not None
        for body, (linear, angular) in wrenches.items():
            world.simulation.apply_wrench(body, linear[None], angular[None])

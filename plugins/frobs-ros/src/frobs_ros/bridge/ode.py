"""The numbers of ODE's solver, which clients of Gazebo set and read. No FRobs simulator is ODE: they are kept and told."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any


@dataclass
class Ode:
    """As gazebo_msgs/ODEPhysics, with Gazebo's defaults."""

    auto_disable_bodies: bool = False
    sor_pgs_precon_iters: int = 0
    sor_pgs_iters: int = 50
    sor_pgs_w: float = 1.3
    sor_pgs_rms_error_tol: float = 0.0
    contact_surface_layer: float = 0.001
    contact_max_correcting_vel: float = 100.0
    cfm: float = 0.0
    erp: float = 0.2
    max_contacts: int = 20

    def read(self, message: Any) -> None:
        """Take the numbers of a message."""
        for field in fields(self):
            setattr(self, field.name, getattr(message, field.name))

    def write(self, message: Any) -> None:
        """Write the numbers into a message."""
        for field in fields(self):
            setattr(message, field.name, getattr(self, field.name))

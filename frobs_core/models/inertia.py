"""Inertia matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from frobs_core.models.model import Inertial
from frobs_core.util.arrays import Floats
from frobs_core.util.rotations import matrix_from_quat


def inertia_matrix(inertial: Inertial) -> Floats:
    """Return the inertia about the center of mass, expressed in the link's axes, (3, 3) [kg·m²]."""
    rotation = matrix_from_quat(inertial.origin.quat_wxyz)
    turned: Floats = rotation @ symmetric_matrix(inertial.inertia) @ rotation.T
    return turned


def parallel_axis(mass: float, arm: Floats) -> Floats:
    """Return the inertia, (3, 3) [kg·m²], that a mass [kg] adds about a point at the offset ``arm``, (3,) [m]."""
    return np.asarray(mass * ((arm * arm).sum() * np.eye(3) - np.outer(arm, arm)))


def symmetric_matrix(moments: Sequence[float]) -> Floats:
    """Return the symmetric matrix, (3, 3), of the values ixx, ixy, ixz, iyy, iyz and izz."""
    ixx, ixy, ixz, iyy, iyz, izz = moments
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])

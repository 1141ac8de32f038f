"""How large the numbers of a model file may be: beyond these they are mistakes, and engines overflow."""

from __future__ import annotations

MAX_MASS = 1e9
"""[kg]"""

MAX_INERTIA = 1e12
"""[kg·m²]"""

MAX_LENGTH = 1e6
"""Of sizes, positions and scales, [m]."""

MAX_COEFFICIENT = 1e10
"""Of densities, stiffnesses, dampings, frictions, armatures and gear ratios, each in its own unit."""

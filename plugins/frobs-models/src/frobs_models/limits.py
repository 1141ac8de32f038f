"""Limits for the numbers in a model file. Larger numbers are probably mistakes and can cause overflows in engines."""

from __future__ import annotations

MAX_MASS = 1e9
"""[kg]"""

MAX_INERTIA = 1e12
"""[kg·m²]"""

MAX_LENGTH = 1e6
"""Limit for sizes, positions and scales [m]."""

MAX_COEFFICIENT = 1e10
"""Limit for densities, stiffnesses, dampings, frictions, armatures and gear ratios, in the unit of each quantity."""

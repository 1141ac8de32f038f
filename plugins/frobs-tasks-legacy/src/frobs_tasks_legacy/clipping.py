"""Observation terms that stay in their bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from frobs_core.description import ObservationTerm


def clipped(term: ObservationTerm) -> ObservationTerm:
    """Return a term whose values are clipped to its bounds."""
    return replace(term, read=lambda: np.clip(term.read(), term.low, term.high))

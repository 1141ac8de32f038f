"""A flat observation that is composed of named terms: the core's, under the name that this package had it by."""

from frobs_core.flat_observation import FlatObservation, ObservationTerm

__all__ = ["FlatObservation", "ObservationTerm"]

"""What the doctor is told about MuJoCo; that it covers robots, and what overlaps, the conformance kit checks."""

from __future__ import annotations

from frobs_models import ELEMENTS, read_tables
from frobs_sim_mujoco.simulation import TABLES


def test_every_kind_of_element_has_a_row() -> None:
    assert set().union(*read_tables(TABLES).values()) == set(ELEMENTS)

"""Budgets for robot files and meshes from strangers; see :mod:`frobs_core.util.budgets`."""

from __future__ import annotations

from collections.abc import Mapping

BUDGETS: Mapping[str, Mapping[str, int]] = {
    "robot file": {
        "bytes": 4 * 2**20,
        "elements": 50_000,
        "attributes": 100_000,
        "levels of nesting": 400,
        "attributes of one element": 100,
        "characters of numbers": 2_000,
        "included files": 200,
        "links": 500,
        "MJCF elements": 20_000,
        "<geom> elements": 3_000,
        "<site> elements": 5_000,
        "<joint> elements": 2_000,
        "<camera> elements": 500,
        "<light> elements": 500,
        "actuators": 2_000,
        "inherited attributes": 1_000_000,
        "pixels of textures": 2**24,
        "cells of height fields": 2**24,
        "xacro steps": 300_000,
        "characters of one text": 1_000_000,
        "characters of one expression": 5_000,
        "values of one list": 100_000,
        "levels of nested lists": 50,
    },
    "mesh": {
        "bytes with the files that it names": 256 * 2**20,
        "triangles": 2_000_000,  # building a model from a larger mesh appears to hang
        "triangles to decompose": 20_000,
        "vertices": 12_000_000,
        "parts": 2_000,  # shapes with one material, counted each time the scene uses them
        "levels of nesting": 100,
        "materials": 1_000,  # the reading time is proportional to the square of this number
    },
}
"""Limits by kind of file and by what is counted, such as ``BUDGETS["mesh"]["bytes with the files that it names"]``."""

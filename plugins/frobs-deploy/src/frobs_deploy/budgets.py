"""Budgets for policy bundles from strangers. SECURITY.md lists them together with the budgets of the other files."""

from __future__ import annotations

from collections.abc import Mapping

BUDGET: Mapping[str, int] = {
    "bytes of bundle.json": 8 * 2**20,
    "bytes of policy.onnx": 2**30,
    "levels of nesting in bundle.json": 50,
    "values in bundle.json": 500_000,
    "nodes of the graph": 5_000,
    "fields of the graph": 200_000,
    "elements that the graph computes in one call": 2**28,
    "multiplications of the graph per observation": 20_000_000_000,
}
"""Limits by what is counted. Counts instead of seconds, so that the same files are accepted on every machine."""


def exceeds(what: str, count: int) -> str | None:
    """Return the reason to reject a bundle, or None if a count is within its limit."""
    return f"it has {count:,} {what}; the limit is {BUDGET[what]:,}" if count > BUDGET[what] else None

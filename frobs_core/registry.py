"""Registering the Gymnasium IDs of all plugins: strings only, nothing is imported."""

from __future__ import annotations


def register_environments() -> None:
    """Register every environment record and ``frobs/Env-v0``; twice is harmless."""

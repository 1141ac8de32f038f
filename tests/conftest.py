"""Fixtures for all tests of the core."""

pytest_plugins = ["frobs_core.testing.fixtures"]

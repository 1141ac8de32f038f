"""Fixtures for all tests of the core."""

pytest_plugins = ["frobs_devkit.testing.fixtures"]

"""Environments: how the parts are put together, and what a step and a reset do."""

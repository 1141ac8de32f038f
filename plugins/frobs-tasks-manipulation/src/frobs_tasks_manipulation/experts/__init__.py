"""Scripted experts that solve the manipulation tasks."""

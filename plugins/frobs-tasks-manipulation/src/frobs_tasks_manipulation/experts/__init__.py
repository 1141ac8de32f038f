"""Scripted experts for the manipulation tasks."""

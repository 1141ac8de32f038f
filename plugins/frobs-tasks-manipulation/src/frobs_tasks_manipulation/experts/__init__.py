"""Scripted experts of the manipulation tasks."""
